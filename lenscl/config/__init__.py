"""Study files: TOML in, frozen and validated values out.

In: the text of a study. Out: a `Study` (a `Scene`, the points of its sweep, its images), or a StudyError that lists
every problem, each led by its TOML key. Nothing in a study file can run code.

>>> scene = scene_from_toml('''
... source = { at = [0, 0, 4] }
... film = { centre = [0, 0, 2.5], right = [2, 0, 0], down = [0, -2, 0], size = [64, 64] }
... picture = { centre = [0, 0, -2.5], right = [6, 0, 0], down = [0, -6, 0] }
... lens = [{ surface = "torus", r = 0.3, n = "BK7" }]
... ''')
>>> scene.replace({"lens.r": 0.2, "film.scale": 0.4}).film.corner
(-0.4, 0.4, 2.5)
"""

from __future__ import annotations

from lenscl.config.accuracy import Accuracy
from lenscl.config.lens import Group, Lens, Lenses
from lenscl.config.places import Places
from lenscl.config.scene import Effects, Film, Needs, Numerics, Picture, Scene, Source
from lenscl.config.study import Output, Point, Study, load_study, parse_override, scene_from_toml, study_from_toml
from lenscl.config.sweep import Sweep
from lenscl.config.tables import study_schema

__all__ = [
    "Accuracy",
    "Effects",
    "Film",
    "Group",
    "Lens",
    "Lenses",
    "Needs",
    "Numerics",
    "Output",
    "Picture",
    "Places",
    "Point",
    "Scene",
    "Source",
    "Study",
    "Sweep",
    "load_study",
    "parse_override",
    "scene_from_toml",
    "study_from_toml",
    "study_schema",
]
