"""The faces of solids by name: they make up the solid, and every surface point lies on one of them."""

from __future__ import annotations

import numpy as np
import pytest
from scenes import EVERY

from lenscl.expr import evaluate
from lenscl.lenses import (
    Surface,
    catalogue,
    coat_functions,
    coated_planes,
    face_at,
    face_functions,
    face_names,
    is_whole,
    user_surface,
)

BOUNDS = ((-2.0, -2.0, -2.0), (2.0, 2.0, 2.0))
WRITTEN = {
    "x^2 + y^2 + z^2 - 1": ("1",),
    "max(x^2 + y^2 - 1, z - 1, -z - 1)": ("1", "2", "3"),
    "max(max(abs(x) - 1, y - 1), max(-y - 1, abs(z) - 1))": ("1", "2", "3", "4"),
    "max(tanh(5*(x^2 + y^2 + z^2 - 1)), exp(z) - 1)": ("1", "2"),
    "max(min(x^2 + y^2 + z^2 - 1, (x - 1)^2 + y^2 + z^2 - 0.5), z^3)": ("1", "2"),
    "2*max(abs(x), abs(y), abs(z)) - 1": ("1",),
}


def values_of(surface: Surface) -> dict[str, float]:
    return {parameter.name: parameter.default for parameter in surface.parameters}


@pytest.mark.parametrize("name", EVERY)
def test_the_faces_of_the_catalogue_make_up_its_solids(name: str) -> None:
    surface = catalogue()[name]
    values = values_of(surface)
    low, high = np.array(surface.box(values))
    points = np.random.default_rng(5).uniform(1.2 * low - 0.2 * high, 1.2 * high - 0.2 * low, (20_000, 3))
    at = values | dict(zip("xyz", points.T, strict=True))
    whole = evaluate(surface.expression, at)
    faces = np.stack([np.broadcast_to(evaluate(face, at), len(points)) for face in face_functions(surface).values()])
    assert 0 < np.count_nonzero(whole < 0) < len(points)
    np.testing.assert_array_equal(faces.max(axis=0) < 0, whole < 0)


@pytest.mark.parametrize(("text", "names"), WRITTEN.items())
def test_the_faces_of_an_expression_are_the_operands_of_its_outermost_max(text: str, names: tuple[str, ...]) -> None:
    surface = user_surface(text, [], BOUNDS)
    assert face_names(surface) == names
    points = np.random.default_rng(6).uniform(-2, 2, (20_000, 3))
    at = dict(zip("xyz", points.T, strict=True))
    faces = np.stack([np.broadcast_to(evaluate(face, at), len(points)) for face in face_functions(surface).values()])
    whole = evaluate(surface.as_written, at)
    assert 0 < np.count_nonzero(whole < 0) < len(points)
    np.testing.assert_array_equal(faces.max(axis=0) < 0, whole < 0)


def test_the_names_are_those_of_opticians() -> None:
    assert face_names(catalogue()["plano_convex"]) == ("front", "back", "rim")
    assert face_names(catalogue()["box"]) == ("+x", "-x", "+y", "-y", "+z", "-z")
    assert face_names(catalogue()["sphere"]) == ("surface",)
    assert face_names(catalogue()["polyhedron"]) == tuple("12345678")


@pytest.mark.parametrize(
    ("name", "point", "face"),
    [
        ("plano_convex", (0.1, 0.0, -0.2), "front"),
        ("plano_convex", (0.1, 0.0, 0.225), "back"),
        ("plano_convex", (0.7, 0.0, 0.2), "rim"),
        ("drum", (0.0, 0.0, -0.7), "front"),
        ("drum", (0.0, 0.0, 0.7), "back"),
        ("drum", (0.45, 0.0, 0.1), "rim"),
        ("prism", (0.0, 0.0, -0.3), "front"),
        ("wedge", (0.0, 0.0, 0.15), "back"),
        ("brilliant", (0.0, 0.0, 0.2277), "table"),
        ("box", (0.0, -0.5, 0.1), "-y"),
    ],
)
def test_a_point_lies_on_the_face_of_that_name(name: str, point: tuple[float, float, float], face: str) -> None:
    surface = catalogue()[name]
    assert face_at(surface, values_of(surface), point) == face


def test_the_planes_of_a_solid_belong_to_its_faces() -> None:
    assert coated_planes(catalogue()["box"], ["+y", "-z"]) == (False, False, True, False, False, True)
    assert sum(coated_planes(catalogue()["brilliant"], ["mains", "table"]) or ()) == 9
    written = user_surface("max(abs(x) - 1, y - 1, -y - 1, abs(z) - 1, x + y + z - 2)", [], BOUNDS)
    assert len(written.planes) == 7
    assert coated_planes(written, ["1", "5"]) == (True, True, False, False, False, False, True)


def test_coated_faces_and_the_others_are_told_apart() -> None:
    surface = user_surface("max(x^2 + y^2 - 1, z - 1, -z - 1)", [], BOUNDS)
    coat, rest = coat_functions(surface, ["2"])
    top = {"x": 0.3, "y": 0.2, "z": 1.0}
    assert evaluate(coat, top) == 0.0 > evaluate(rest, top)
    assert is_whole(surface, ["3", "1", "2"])
    assert not is_whole(surface, ["3", "1"])
