"""Which values make a lens: the rules of two faces and a rim, and what their messages advise."""

from __future__ import annotations

import math
import re
from typing import Any

import numpy as np
import pytest
from lenses import analytic
from scenes import make_scene

from lenscl.config import Scene
from lenscl.errors import StudyError
from lenscl.expr import evaluate
from lenscl.lenses import surface
from lenscl.lenses.singlets import Face

RULED = ("biconvex", "plano_convex", "meniscus", "conic_singlet", "even_asphere_singlet")


def values_of(name: str, given: dict[str, float]) -> dict[str, float]:
    return {parameter.name: parameter.default for parameter in surface(name).parameters} | given


def problems(name: str, given: dict[str, float]) -> dict[str, str]:
    return dict(surface(name).problems(values_of(name, given)))


@pytest.mark.parametrize(
    ("name", "given", "key", "message"),
    [
        ("biconvex", {"R1": 0.6, "thickness": 2.0}, "diameter", "at most 1.2, where the face of R1 ends, got 1.4"),
        ("biconvex", {"R2": 0.6, "thickness": 2.0}, "diameter", "at most 1.2, where the face of R2 ends"),
        (
            "plano_convex",
            {"R": 0.5, "thickness": 2.0},
            "diameter",
            "at most 1, where the face of R ends, got 1.4; lower it",
        ),
        ("biconvex", {"thickness": 0.1}, "thickness", "at least 0.3467"),
        ("plano_convex", {"thickness": 0.2}, "thickness", "at least 0.28585"),
        ("meniscus", {"thickness": 0.1}, "thickness", "or the faces cross before the rim, got 0.1; raise it, or lower"),
        (
            "conic_singlet",
            {"c1": 1.5, "thickness": 2.0},
            "diameter",
            "at most 1.33333, where the face of c1 and k1 ends",
        ),
        ("conic_singlet", {"c2": 1.0, "k2": 3.0}, "diameter", "at most 1, where the face of c2 and k2 ends"),
        ("conic_singlet", {"thickness": 0.01}, "thickness", "or the faces cross"),
        ("even_asphere_singlet", {"A4": 3.0}, "thickness", "or the faces cross"),
        ("even_asphere_singlet", {"A4": -3.0, "A6": 6.0, "thickness": 0.1}, "thickness", "or the faces cross"),
    ],
)
def test_what_is_no_lens_is_an_error_of_its_key(name: str, given: dict[str, float], key: str, message: str) -> None:
    found = problems(name, given)
    assert list(found) == [key]
    assert message in found[key]
    lens = {"surface": name, **given}
    with pytest.raises(StudyError, match=rf"^lens\.{key}: must be at") as caught:
        make_scene(lens)
    # What it advises is a lens, and a little less is none
    limit = float(re.search(r"at (?:most|least) (\S+?)[,;]", str(caught.value))[1])  # type: ignore[index]
    assert list(make_scene(lens | {key: limit}).lenses[0].surface.problems(values_of(name, given | {key: limit}))) == []
    beyond = limit * (1 + 1e-4 if key == "diameter" else 1 - 1e-4)
    assert list(problems(name, given | {key: beyond})) == [key]


def test_a_parameter_out_of_its_range_is_told_before_the_rules() -> None:
    assert problems("biconvex", {"R1": -1.0, "thickness": 1e-3}).keys() == {"R1"}
    assert problems("conic_singlet", {"c1": math.nan, "diameter": 0.0}).keys() == {"c1", "diameter"}
    assert "finite" in problems("plano_convex", {"R": math.inf})["R"]


def test_limits_are_lenses_and_rounding_refuses_none() -> None:
    """Balls, half balls, hemispheres on rods and knife edges, whatever their size."""
    for r in (0.7, 1 / 3, 1.1e-3, 12.7, 1e6, 0.1 + 0.2):
        assert problems("biconvex", {"R1": r, "R2": r, "thickness": 2 * r, "diameter": 2 * r}) == {}
        assert problems("plano_convex", {"R": r, "thickness": r, "diameter": 2 * r}) == {}
        ball = {"c1": 1 / r, "c2": -1 / r, "thickness": 2 * r, "diameter": 2 * r}
        assert problems("conic_singlet", ball) == {}
        assert problems("even_asphere_singlet", ball) == {}
        edge = 2 * (r - math.sqrt(r * r - 0.16 * r * r))
        assert problems("biconvex", {"R1": r, "R2": r, "thickness": edge, "diameter": 0.8 * r}) == {}
        assert problems("biconvex", {"R1": r, "R2": r, "thickness": edge * (1 - 1e-9), "diameter": 0.8 * r}) != {}


def test_faces_that_cross_inside_the_rim_alone_are_told() -> None:
    """Apart at the vertex and at the rim, but not between."""
    given = {"c1": 0.0, "k1": 0.0, "A4": 2.0, "A6": -3.0, "c2": 0.0, "k2": 0.0, "thickness": 0.1, "diameter": 1.6}
    sag = [2 * r**4 - 3 * r**6 for r in (0.0, math.sqrt(4 / 9), 0.8)]
    assert sag[1] > 0.1 > max(sag[0], sag[2])
    assert list(problems("even_asphere_singlet", given)) == ["thickness"]
    assert problems("even_asphere_singlet", given | {"thickness": sag[1] * (1 + 1e-12)}) == {}
    assert problems("even_asphere_singlet", given | {"thickness": sag[1] * (1 - 1e-9)}) != {}


def drawn(rng: np.random.Generator) -> dict[str, float]:
    """Return an even asphere of any kind: lens, crossing faces, faces that end; a third of them without even terms."""
    even = rng.uniform(-0.5, 0.5, 6) * (rng.random() > 1 / 3)
    return {
        **dict(zip(("c1", "c2"), rng.uniform(-2.0, 2.0, 2).tolist(), strict=True)),
        **dict(zip(("k1", "k2"), rng.uniform(-4.0, 3.0, 2).tolist(), strict=True)),
        **dict(zip(("A4", "A6", "A8", "B4", "B6", "B8"), even.tolist(), strict=True)),
        "thickness": float(rng.uniform(0.01, 0.7)),
        "diameter": float(rng.uniform(0.1, 1.6)),
    }


def test_the_rules_are_those_of_the_sags() -> None:
    rng = np.random.default_rng(1)
    seen = {"ends": 0, "crosses": 0, "lens": 0}
    for _ in range(600):
        values = drawn(rng)
        front, back, _ = analytic.FACES["even_asphere_singlet"](values)
        assert isinstance(front, analytic.Sag)
        assert isinstance(back, analytic.Sag)
        q = (values["diameter"] / 2) ** 2 * np.linspace(0, 1, 2001).astype(np.longdouble)
        found = list(problems("even_asphere_singlet", values))
        if any((1 + face.k) * face.c**2 * q[-1] > 1 for face in (front, back)):
            seen["ends"] += 1
            assert found == ["diameter"]
            continue
        least = (values["thickness"] + back.sag(q) - front.sag(q)).min()
        if abs(least) > 1e-5:  # the samples here are no better
            seen["crosses" if least < 0 else "lens"] += 1
            assert found == ([] if least > 0 else ["thickness"])
    assert min(seen.values()) > 30


def test_a_lens_has_the_sign_of_its_sags_everywhere_and_lies_in_its_box() -> None:
    rng = np.random.default_rng(2)
    row, tried = surface("even_asphere_singlet"), 0
    for _ in range(250):
        values = drawn(rng)
        if problems("even_asphere_singlet", values):
            continue
        tried += 1
        low, high = (np.array(corner) for corner in row.box(values))
        p = rng.uniform(low - 0.5 * (high - low), high + 0.5 * (high - low), (3000, 3))
        faces = analytic.FACES["even_asphere_singlet"](values)
        depth = np.max([face.beyond(p.astype(np.longdouble)) for face in faces], 0)
        F = evaluate(row.expression, values | dict(zip("xyz", p.T, strict=True)))
        sure = np.abs(depth) > 1e-9
        assert sure.sum() > 2990
        np.testing.assert_array_equal(F[sure] < 0, depth[sure] < 0)
        assert (F < 0).sum() > 10
        assert ((p[F <= 0] >= low) & (p[F <= 0] <= high)).all()
    assert tried > 100


def test_a_face_is_as_its_radius_says() -> None:
    assert Face(c=0.5).sag(1.0) == pytest.approx(2 - math.sqrt(3), rel=1e-15)
    assert Face(c=-0.5).sag(1.0) == -Face(c=0.5).sag(1.0)
    assert Face(c=0.5, k=-1.0).sag(2.0) == 1.0  # a paraboloid, c r^2 / 2
    assert Face(c=1e-9).sag(1.0) == pytest.approx(5e-10, rel=1e-15)  # nothing cancels
    assert Face(c=0.5).reach == 2.0
    assert Face(c=0.5, k=3.0).reach == 1.0
    assert Face(c=0.5, k=-1.0).reach == Face(c=0.5, k=-2.0).reach == Face(c=0.0).reach == math.inf


def test_a_sweep_through_flat_is_one_form() -> None:
    """Bending from meniscus to meniscus, by way of plano-convex, equiconvex and plano-convex."""
    scene: Scene = make_scene({"surface": "conic_singlet"})
    keys = set()
    for bend in np.linspace(-1.0, 1.0, 9):
        bent: Any = scene.replace({"lens.c1": 0.4 + 0.8 * bend, "lens.c2": -0.4 + 0.8 * bend})
        keys.add(bent.lenses[0].surface.key)
    assert keys == {"conic_singlet"}
