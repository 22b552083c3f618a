"""Which values make a drum, a cylinder, a torus, a wedge or an asphere, and what optional terms cost."""

from __future__ import annotations

import math
import re

import numpy as np
import pytest
from scenes import make_scene

from lenscl import compile_count, trace
from lenscl.errors import StudyError
from lenscl.expr import evaluate
from lenscl.lenses import surface

WRONG: list[tuple[dict[str, float | str], str, str]] = [
    ({"surface": "biconcave", "R1": 0.6}, "diameter", "at most 1.2, where the face of R1 ends, got 1.4"),
    ({"surface": "biconcave", "thickness": 0.0}, "thickness", "more than 0"),
    ({"surface": "drum", "diameter": 1.5}, "diameter", "at most the length, which is that of the ball, 1.4, got 1.5"),
    (
        {"surface": "cylindrical_singlet", "height": 2.6, "thickness": 2.0},
        "height",
        "at most 2.5, where the face of c1 and k1 ends",
    ),
    (
        {"surface": "cylindrical_singlet", "thickness": 0.2},
        "thickness",
        "cross before the rim, got 0.2; raise it, or lower height",
    ),
    ({"surface": "toroidal_singlet", "thickness": 0.1}, "thickness", "or the faces cross before the rim, got 0.1"),
    ({"surface": "toroidal_singlet", "c1x": 1.5}, "diameter", "the face of c1x and c1y ends before the rim"),
    ({"surface": "toroidal_singlet", "c2y": -1.5}, "diameter", "the face of c2x and c2y ends before the rim"),
    ({"surface": "wedge", "angle": 40.0}, "thickness", "at least 0.50346, or the faces cross within the height"),
    ({"surface": "wedge", "angle": 85.0}, "angle", "at most 80"),
    ({"surface": "brilliant", "table": 85.0, "star": 30.0}, "star", "or the stars would rise from it, got 30.0"),
    ({"surface": "asphere_singlet", "A4": 3.0}, "thickness", "or the faces cross"),
    ({"surface": "asphere_singlet", "A21": 3.0}, "A21", "unknown key; did you mean"),
    ({"surface": "box", "a": 0.0}, "a", "more than 0"),
]


@pytest.mark.parametrize(("lens", "key", "message"), WRONG)
def test_what_is_no_lens_is_an_error_of_its_key(lens: dict[str, float | str], key: str, message: str) -> None:
    with pytest.raises(StudyError, match=rf"^lens\.{key}: ") as caught:
        make_scene(lens)
    assert message in str(caught.value)
    if (limit := re.search(r"at (?:most|least) ([\d.]+)[,;] (?:where|or)", str(caught.value))) is not None:
        make_scene(lens | {key: float(limit[1])})  # what it advises is a lens


def test_a_torus_of_equal_curvatures_is_a_ball_and_of_one_a_cylinder() -> None:
    x, y, z = np.random.default_rng(1).uniform(-0.7, 0.7, (3, 20_000))
    inside = {}
    for name, more in (
        ("toroidal_singlet", {"c1x": 0.8, "c1y": 0.8, "c2x": -0.4, "c2y": -0.4}),
        ("conic_singlet", {"c1": 0.8, "c2": -0.4}),
        ("toroidal", {"c1x": 0.0, "c1y": 0.8, "c2x": 0.0, "c2y": -0.4}),
        ("cylindrical_singlet", {"c1": 0.8, "c2": -0.4, "width": 4.0, "height": 1.4}),
    ):
        row = surface("toroidal_singlet" if name == "toroidal" else name)
        values = {parameter.name: parameter.default for parameter in row.parameters} | more
        inside[name] = evaluate(row.expression, {**values, "x": x, "y": y, "z": z}) <= 0
    round_rim = np.hypot(x, y) < 0.7
    assert 1000 < inside["conic_singlet"].sum() < 15_000
    np.testing.assert_array_equal(inside["toroidal_singlet"], inside["conic_singlet"])
    np.testing.assert_array_equal(inside["toroidal"][round_rim], inside["cylindrical_singlet"][round_rim])


def test_terms_that_are_left_out_are_not_in_the_kernel_and_those_given_are_numbers() -> None:
    plain = make_scene({"surface": "asphere_singlet"}, film={"size": [8, 8]})
    bent = make_scene({"surface": "asphere_singlet", "A10": 0.1}, film={"size": [8, 8]})
    texts = [trace(scene).kernel.text for scene in (plain, bent)]
    assert "shape.A10" in texts[1]
    assert not re.search(r"shape\.[AB]\d", texts[0])
    before = compile_count()
    for value in (0.0, -0.1, 0.2):
        scene = bent.replace({"lens.A10": value})
        assert scene.lenses[0].values["A10"] == value
        trace(scene)
    assert compile_count() == before
    more = bent.replace({"lens.B3": 0.05})
    assert more.lenses[0].values.keys() == {*bent.lenses[0].values, "B3"}
    assert more.replace({"film.size": [9, 9]}).lenses == more.lenses


def test_an_asphere_is_the_even_asphere_of_its_terms() -> None:
    even = {"A4": 0.1, "A6": -0.05, "B4": 0.05, "B8": 0.1}
    found = [trace(make_scene({"surface": name, **even})) for name in ("asphere_singlet", "even_asphere_singlet")]
    np.testing.assert_array_equal(found[0].status, found[1].status)
    np.testing.assert_array_equal(found[0].events, found[1].events)
    assert np.abs(found[0].st - found[1].st).max() < 1e-12


def test_a_half_balls_focus_and_a_wedges_deviation_are_those_of_the_closed_forms() -> None:
    """By the lensmaker's formula of a thick lens, and Snell's law at the tilted face."""
    n, angle = 1.5, 2.0
    source = {"kind": "parallel", "direction": [0.0, 0.0, 1.0]}
    film = {"centre": [0.0, 0.0, -1.0], "right": [2e-3, 0.0, 0.0], "down": [0.0, -2e-3, 0.0], "size": [8, 8]}
    focal = 0.7 / (n - 1)
    behind = focal - 0.7 / n  # of the flat face: the principal plane lies at the vertex, 0.7 of glass before it
    picture = {"corner": [-1.0, 1.0, 0.35 + behind], "right": [2.0, 0.0, 0.0], "down": [0.0, -2.0, 0.0]}
    ball = trace(make_scene({"surface": "half_ball", "n": n}, source=source, film=film, picture=picture))
    assert np.abs(ball.st - 0.5).max() < 1e-6
    far = {"corner": [-1.0, 1.0, 10.0], "right": [2.0, 0.0, 0.0], "down": [0.0, -2.0, 0.0]}
    lens = {"surface": "wedge", "angle": angle, "n": n}
    wedge = trace(make_scene(lens, source=source, film=film, picture=far))
    turned = math.asin(n * math.sin(math.radians(angle))) - math.radians(angle)
    middle = wedge.st[3:5, 3:5].reshape(-1, 2).mean(0)
    assert middle[0] == pytest.approx(0.5, abs=1e-12)
    assert (middle[1] - 0.5) * 2.0 == pytest.approx((10.0 - 0.15) * math.tan(turned), rel=1e-9)  # to the thick side, -y
