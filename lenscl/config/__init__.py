"""Study files: TOML in, frozen and validated values out.

In: the text of a study. Out: a `Study` (a `Scene`, the points of its sweep, its images), or a StudyError that lists
every problem, each led by its TOML key. Nothing in a study file can run code.
"""

from __future__ import annotations

from lenscl.config.build import scene_from_document
from lenscl.config.load import parse_text
from lenscl.config.scene import Scene


def scene_from_toml(text: str) -> Scene:
    return scene_from_document(parse_text(text))
