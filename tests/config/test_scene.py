"""Scenes as values: what they say, what changing a key keeps, and the way to text and back."""

from __future__ import annotations

import copy
import pickle
import tomllib

import numpy as np
import pytest
from hypothesis import event, given
from hypothesis import strategies as st

from lenscl.config import Scene, scene_from_toml
from lenscl.errors import StudyError

lengths = st.floats(-1e6, 1e6, allow_nan=False)
vectors = st.tuples(lengths, lengths, lengths)
indices = st.one_of(
    st.floats(1.0, 1e3),
    st.sampled_from(["air", "BK7", "fused silica", "diamond", "ice"]),
    st.just({"sellmeier": [1.03961212, 0.231792344, 1.01046945, 0.006, 0.02, 103.56]}),
    st.just({"cauchy": [1.5, 0.004]}),
    st.just({"table": [[400.0, 1.6], [700.0, 1.5]]}),
)
lenses = st.one_of(
    st.fixed_dictionaries(
        {"surface": st.just("torus")}, optional={"R": st.floats(0.3, 2.0), "r": st.floats(0.01, 0.2)}
    ),
    st.fixed_dictionaries({"surface": st.sampled_from(["heart", "bifolia", "sphere", "ellipsoid"])}),
    st.fixed_dictionaries(
        {
            "surface": st.just("x**4 + y**4 + z**4 - k**2 * m"),
            "k": st.floats(0.1, 0.5),
            "m": st.floats(0.1, 1.0),
            "bounds": st.just([[-1, -1, -1], [1, 1, 1]]),
        }
    ),
)


@st.composite
def documents(draw):
    """Draw the document of a valid scene."""

    def screen(size):
        return {
            draw(st.sampled_from(["corner", "centre"])): list(draw(vectors)),
            "right": [draw(st.floats(0.1, 10)), draw(st.floats(-0.05, 0.05)), 0.0],
            "down": [0.0, draw(st.floats(-10, -0.1)), draw(lengths)],
            "scale": draw(st.floats(0.01, 100)),
            "size": [draw(st.integers(1, 4096)), draw(st.integers(1, 4096))],
        }

    lens = []
    for place in range(draw(st.integers(1, 3))):
        lens.append(
            {
                **draw(lenses),
                "name": f"lens_{place}",
                "centre": list(draw(vectors)),
                "stretch": [draw(st.floats(0.001, 1000)), -draw(st.floats(0.001, 1000)), 1.0],
                "rotate": list(draw(vectors)),
                "n": draw(indices),
            }
        )
    point = {"kind": "point", "at": list(draw(vectors))}
    parallel = {"kind": "parallel", "direction": [draw(st.floats(0.1, 1)), 0.0, draw(lengths)]}
    document = {
        "source": draw(st.sampled_from([point, parallel])),
        "film": screen("film"),
        "picture": screen("picture"),
        "medium": {"n": draw(indices)},
        "lens": lens,
        "effects": {"total_reflection": draw(st.sampled_from(["follow", "end", "auto"]))},
        "numerics": {
            "precision": draw(st.sampled_from(["single", "double"])),
            "snell": draw(st.sampled_from(["exact", "paraxial"])),
            "max_events": draw(st.integers(1, 255)),
        },
    }
    if draw(st.booleans()):
        document["numerics"]["tolerance"] = draw(st.floats(1e-15, 1e-3))
        document["picture"]["images"] = ["a/*.png", "b c/*"]
        document["picture"]["outside"] = [0.0, draw(st.floats(0, 1)), 1.0]
        document["picture"]["encoding"] = "linear"
    return document


def as_toml(document) -> str:
    import tomli_w

    return tomli_w.dumps(document)


@given(document=documents())
def test_a_scene_goes_to_text_and_back_unchanged(document):
    scene = scene_from_toml(as_toml(document))
    text = scene.to_toml()
    again = scene_from_toml(text)
    event(f"{len(scene.lenses)} lenses")
    assert again == scene
    assert again.to_toml() == text
    assert hash(again) == hash(scene)
    assert tomllib.loads(text) == scene.document()
    assert pickle.loads(pickle.dumps(scene)) == scene


@given(document=documents())
def test_two_scenes_that_differ_in_one_number_are_written_differently(document):
    scene = scene_from_toml(as_toml(document))
    other = scene.replace({"film.scale": scene.film.scale * 1.5})
    assert other != scene
    assert other.to_toml() != scene.to_toml()
    assert other.replace({"film.scale": scene.film.scale}) == scene


def test_the_order_of_keys_in_a_file_does_not_matter(base):
    assert scene_from_toml(base.replace("R = 0.7\nr = 0.25", "r = 0.25\nR = 0.7")) == scene_from_toml(base)


def test_the_text_of_a_scene_says_everything(base):
    assert scene_from_toml(base).to_toml() == (
        '[source]\nkind = "point"\nat = [0.0, 0.0, 4.0]\n\n'
        "[film]\ncentre = [0.0, 0.0, 2.5]\nright = [2.0, 0.0, 0.0]\ndown = [0.0, -2.0, 0.0]\nscale = 1.0\n"
        "size = [8, 6]\n\n"
        "[picture]\ncentre = [0.0, 0.0, -2.5]\nright = [6.0, 0.0, 0.0]\ndown = [0.0, -6.0, 0.0]\nscale = 1.0\n"
        'size = [1024, 1024]\noutside = [0.0]\nfilter = "bilinear"\n\n'
        '[medium]\nn = "vacuum"\n\n'
        '[[lens]]\nsurface = "torus"\nR = 0.7\nr = 0.25\ncentre = [0.0, 0.0, 0.0]\nstretch = [1.0, 1.0, 1.0]\n'
        "rotate = [0.0, 0.0, 0.0]\nn = 1.5\n\n"
        '[effects]\nabsorption = "auto"\ntotal_reflection = "auto"\nfresnel = false\n'
        "dispersion = false\npath_length = false\nfootprint = false\nantialias = 1\ncaustics = false\n\n"
        '[numerics]\nmethod = "auto"\nprecision = "double"\nsnell = "exact"\nstep = 0.01\nmax_events = 64\n'
    )


def test_scaling_a_screen_keeps_the_point_that_the_file_gives(base):
    centred = scene_from_toml(base)
    cornered = scene_from_toml(base.replace("centre = [0, 0, 2.5]", "corner = [-1, 1, 2.5]"))
    assert centred.film.corner == cornered.film.corner == (-1.0, 1.0, 2.5)
    assert centred.film.centre == cornered.film.centre == (0.0, 0.0, 2.5)
    for factor in (0.5, 3.0):
        assert centred.replace({"film.scale": factor}).film.centre == (0.0, 0.0, 2.5)
        assert cornered.replace({"film.scale": factor}).film.corner == (-1.0, 1.0, 2.5)
        # Also after a trip through text, which a store makes
        assert scene_from_toml(centred.to_toml()).replace({"film.scale": factor}).film.centre == (0.0, 0.0, 2.5)
    assert centred.replace({"film.scale": 3}).film.right == (6.0, 0.0, 0.0)
    assert cornered.replace({"film.scale": 3}).film.centre == (2.0, -2.0, 2.5)


def test_every_key_of_a_scene_can_be_replaced_by_its_own_value(base):
    from lenscl.config.keys import places

    scene = scene_from_toml(base.replace("n = 1.5", 'n = 1.5\nname = "ring"'))
    tried = 0
    for key, place in places(scene.document()).items():
        if place.value() is not None:
            assert scene.replace({key: place.value()}) == scene, key
            tried += 1
    assert tried > 60


@pytest.mark.parametrize(
    ("key", "value", "read", "expected"),
    [
        ("lens.r", 0.2, lambda scene: scene.lenses[0].values["r"], 0.2),
        ("lens.r", np.float32(0.5), lambda scene: scene.lenses[0].values["r"], 0.5),
        ("lens.n", "diamond", lambda scene: scene.lenses[0].material.name, "diamond"),
        ("lens.n", {"cauchy": [1.6]}, lambda scene: scene.lenses[0].n, 1.6),
        ("lens.stretch.y", -2, lambda scene: scene.lenses[0].stretch, (1.0, -2.0, 1.0)),
        ("lens.rotate", np.array([1, 2, 3]), lambda scene: scene.lenses[0].rotate, (1.0, 2.0, 3.0)),
        ("film.size.columns", 16.0, lambda scene: scene.film.size, (16, 6)),
        ("film.size.rows", np.int64(1), lambda scene: (scene.film.columns, scene.film.rows), (8, 1)),
        ("film.corner", (0, 0, 0), lambda scene: (scene.film.keeps, scene.film.corner), ("corner", (0.0, 0.0, 0.0))),
        ("source.at.z", 5, lambda scene: scene.source.at, (0.0, 0.0, 5.0)),
        ("medium.n", 1.33, lambda scene: scene.n_medium, 1.33),
        ("numerics.precision", "single", lambda scene: scene.numerics.precision, "single"),
        ("numerics.tolerance", 1e-9, lambda scene: scene.numerics.tolerance, 1e-9),
        ("effects.total_reflection", "end", lambda scene: scene.effects.total_reflection, "end"),
        ("picture.filter", "nearest", lambda scene: scene.picture.filter, "nearest"),
    ],
)
def test_a_key_reaches_its_value(base, key, value, read, expected):
    scene = scene_from_toml(base)
    before = copy.deepcopy(scene.document())
    assert read(scene.replace({key: value})) == expected
    assert scene.document() == before


def test_a_new_surface_takes_its_own_parameters(base):
    scene = scene_from_toml(base.replace("r = 0.25", "r = 0.3"))
    sphere = scene.replace({"lens.surface": "sphere"}).lenses[0]
    assert dict(sphere.values) == {"r": 0.3}  # set by hand, so it stays
    assert dict(scene_from_toml(base).replace({"lens.surface": "sphere"}).lenses[0].values) == {"r": 1.0}
    assert dict(scene.replace({"lens.surface": "sphere", "lens.r": 2}).lenses[0].values) == {"r": 2.0}
    user = scene.replace({"lens.surface": "x**2 + y**2 + z**2 - r**2", "lens.bounds": [[-1, -1, -1], [1, 1, 1]]})
    assert user.lenses[0].bounds == ((-1.0, -1.0, -1.0), (1.0, 1.0, 1.0))
    assert user.replace({"lens.surface": "heart"}).lenses[0].bounds is None


def test_a_source_can_become_parallel(base):
    scene = scene_from_toml(base).replace({"source.kind": "parallel", "source.direction": [0, 0, -3]})
    assert (scene.source.kind, scene.source.at, scene.source.direction) == ("parallel", None, (0.0, 0.0, -3.0))


@pytest.mark.parametrize(
    "key", ["lens", "lens.", "lens.stretch.w", "film.corner.x", "", "a.b.c", "sweep.mode", "title"]
)
def test_a_key_that_points_nowhere_is_refused(base, key):
    with pytest.raises(StudyError) as caught:
        scene_from_toml(base).replace({key: 1})
    (problem,) = caught.value.problems
    assert "unknown key" in problem


CLASHES = [
    ({"film.size": 3, "film.size.columns": 4}, "film.size.columns: is set already, as a part of film.size"),
    ({"film.size.rows": 4, "film.size": [3]}, "film.size.rows: is set already, as a part of film.size"),
    ({"film.size": [3, 4], "film.size.rows": 4}, "film.size.rows: is set already, as a part of film.size"),
    ({"lens.stretch": 1, "lens.ring.stretch.x": 2}, "lens.ring.stretch.x: is set already, as a part of lens.stretch"),
    ({"lens.ring.stretch": 1, "lens.stretch.x": 2}, "lens.stretch.x: is set already, as a part of lens.ring.stretch"),
    ({"lens.r": 0.1, "lens.ring.r": 0.2}, "lens.ring.r: is set already, as lens.r"),
    ({"lens.rotate.x": 1, "lens.ring.rotate.x": 2}, "lens.ring.rotate.x: is set already, as lens.rotate.x"),
    ({"film.centre": 1, "film.centre.z": 2}, "film.centre.z: is set already, as a part of film.centre"),
    ({"film.corner": [0, 0, 1], "film.corner.z": 2}, "film.corner.z: is set already, as a part of film.corner"),
]


@pytest.mark.parametrize(("changes", "problem"), CLASHES)
def test_two_keys_for_one_value_are_refused(base, changes, problem):
    scene = scene_from_toml(base.replace("n = 1.5", 'n = 1.5\nname = "ring"'))
    with pytest.raises(StudyError) as caught:
        scene.replace(changes)
    assert caught.value.problems == (f"{problem}; keep one of the two",)


@pytest.mark.parametrize("screen", ["film", "picture"])
@pytest.mark.parametrize("given", ["corner", "centre"])
def test_a_corner_and_a_centre_together_are_one_too_many(base, screen, given):
    scene = scene_from_toml(base).replace({f"{screen}.{given}": [0, 0, 1]})
    other = "corner" if given == "centre" else "centre"
    whole = {f"{screen}.{given}": [0, 0, 1], f"{screen}.{other}": [0, 0, 2]}
    part = {f"{screen}.{given}.z": 1, f"{screen}.{other}": [0, 0, 2]}
    for changes in (whole, dict(reversed(whole.items())), part, dict(reversed(part.items()))):
        with pytest.raises(StudyError) as caught:
            scene.replace(changes)
        (problem,) = caught.value.problems
        assert problem == (f"{screen}.corner: only one of the two may be given, {screen}.corner or {screen}.centre")


def test_a_parameter_called_like_a_vector_has_no_components(base):
    ball = base.replace('surface = "torus"\nR = 0.7\nr = 0.25', BALL)
    scene = scene_from_toml(ball)
    assert dict(scene.replace({"lens.size": 0.75}).lenses[0].values)["size"] == 0.75
    with pytest.raises(StudyError, match=r"lens\.size\.columns: unknown key"):
        scene.replace({"lens.size.columns": 1})
    moved = scene_from_toml(ball.replace("n = 1.5", "n = 1.5\ncentre = [0, 0, 1]")).replace({"lens.corner": 0.5})
    assert moved.lenses[0].centre == (0.0, 0.0, 1.0)


BALL = """surface = "x**2 + y**2 + z**2 - size**2 + corner - right"
size = 0.5
corner = 0.25
right = 0.25
bounds = [[-1, -1, -1], [1, 1, 1]]"""


def test_nearly_parallel_and_mirrored_spans_are_allowed(base):
    assert isinstance(scene_from_toml(base.replace("right = [2, 0, 0]", "right = [1e-12, 2, 0]")), Scene)
    assert isinstance(scene_from_toml(base.replace("right = [2, 0, 0]", "right = [-2, 0, 0]")), Scene)
    with pytest.raises(StudyError, match=r"film\.down: is parallel"):
        scene_from_toml(base.replace("right = [2, 0, 0]", "right = [1e-17, 2, 0]"))


@pytest.mark.parametrize("size", [[1, 1], [1, 7], [7, 1], [3, 7]])
def test_films_of_any_shape_are_allowed(base, size):
    assert scene_from_toml(base.replace("size = [8, 6]", f"size = {size}")).film.size == tuple(size)


@pytest.mark.parametrize("n", [1.0, 1.0 + 1e-12, 1e3, 0.7])
def test_hard_indices_are_allowed(base, n):
    assert scene_from_toml(base.replace("n = 1.5", f"n = {n!r}")).lenses[0].n == n
