"""Hard spots of a lens's shape are found where they are, and near misses are not taken for them."""

from __future__ import annotations

import itertools
import math
import re
from typing import Any

import numpy as np
import pytest
from scenes import CATALOGUE, CONFIGS, make_scene

from lenscl import RayStatus, trace
from lenscl.config import Scene, load_study
from lenscl.expr import evaluate, parse
from lenscl.sweep import hard_spots, study_hard_spots
from lenscl.sweep.creases import crease_points
from lenscl.sweep.singular import singular_points
from lenscl.sweep.values import _poles, _regions
from lenscl.sweep.view import on_film
from lenscl.tracing import Placement, film_rays

BOUNDS = [[-2.0, -2.0, -2.0], [2.0, 2.0, 2.0]]
TEARDROP = "max(x^2 + y^2 - z^2*(1 - z){}, x^2 + y^2 + z^2 - 2)"


def expression(text: str) -> dict[str, Any]:
    return {"surface": text, "bounds": BOUNDS}


def kinds(scene: Scene) -> set[str]:
    return {spot.kind for spot in hard_spots(scene)}


STAR = "sqrt(x^2 + y^2) - 0.6 - 0.15*sin({}*atan2(y, x))"
CELLS = "sin({0}*x)*sin({0}*y)*sin({0}*z)"
POLES = [  # and nearly so
    ("z^2 + 0.2*(x^2+y^2) - 0.1 + 0.001/(x^2+y^2)", "z^2 + 0.2*(x^2+y^2) - 0.1 + 0.001/(x^2+y^2+1e-6)"),
    ("x^2+y^2+z^2-0.5 + 0.01/((x-0.31)^2+y^2+(z-0.2)^2)", "x^2+y^2+z^2-0.5 + 0.01/((x-0.31)^2+y^2+(z-2.2)^2)"),
    ("max(0.001/(x - 0.31) - 1, x^2+y^2+z^2-0.9)", "max(0.001/(x - 2.31) - 1, x^2+y^2+z^2-0.9)"),
    ("x^2+y^2+z^2-0.5 + 0.01/(x^2 - 2*x*y + y^2)", "x^2+y^2+z^2-0.5 + 0.01/(x^2 - 2*x*y + y^2 + 0.01)"),
    ("x^2+y^2+z^2-0.5 - 0.01*log(abs(x - 0.3*y))", "x^2+y^2+z^2-0.5 - 0.01*log(abs(x - 0.3*y) + 0.01)"),
    ("max(tan(2*x) + z, x^2+y^2+z^2-0.8)", "max(tan(x/2) + z, x^2+y^2+z^2-0.8)"),
    ("x^2+y^2+z^2-0.5 + 0.01*pow(abs(x), -0.5)", "x^2+y^2+z^2-0.5 + 0.01*pow(abs(x), 0.5)"),
]
FLAT = "(x^2 + y^2 + z^2 - 1)^3 + (x^2 + y^2 + z^2 - 1)^5"  # has no slope where it is 0
FOUND = [
    ("singular", {"surface": "heart"}, {"surface": "sphere"}),
    ("singular", {"surface": "bifolia"}, expression("(x^2+y^2+z^2)^2 - 3*y*(x^2+z^2) + 1e-5")),
    ("singular", {"surface": "torus", "R": 0.3, "r": 0.3}, {"surface": "torus", "R": 0.3, "r": 0.299}),
    ("singular", {"surface": "torus", "R": 0.3, "r": 0.4}, {"surface": "torus", "R": 0.4, "r": 0.3}),
    ("spindle", {"surface": "torus", "R": 0.3, "r": 0.301}, {"surface": "torus", "R": 0.3, "r": 0.3}),
    ("singular", {"surface": "cone"}, {"surface": "plano_convex"}),
    ("singular", {"surface": "barth_sextic", "stretch": [0.3] * 3}, {"surface": "biconvex"}),
    ("singular", {"surface": "cone", "height": 0.05}, {"surface": "rod", "length": 0.05}),
    ("singular", expression(TEARDROP.format("")), expression(TEARDROP.format("+ 1e-5"))),
    ("singular", expression("sqrt(x^2 + y^2) + abs(z) - 0.5"), expression("sqrt(x^2 + y^2 + 1e-4) + z^2 - 0.5")),
    ("no-slope", expression(FLAT), expression("(x^2 + y^2 + z^2 - 1)^3")),
    ("no-slope", expression(FLAT.replace("y", "2*y")), expression("1e-9*(x^2 + 2*y^2 + z^2 - 1)")),
    ("no-slope", expression(FLAT), expression("exp(exp(exp(x^2 + y^2 + z^2))) - 1e300")),
    ("no-inside", expression("(x^2 + y^2 + z^2 - 1)^2"), expression("(x^2 + y^2 + z^2 - 1)^2 - 0.01")),
    ("no-value", expression("max(sqrt(x + 0.5) - 1, x^2+y^2+z^2-1)"), expression("max(sqrt(x+2) - 2, x^2+y^2+z^2-1)")),
    ("overflow", expression("exp(400*(x^2+y^2+z^2)) - exp(200)"), expression("exp(9*(x^2+y^2+z^2)) - exp(5)")),
    *(("pole", *map(expression, texts)) for texts in POLES),
    ("crease", expression("sqrt(abs(x) + 0.1) + y^2 + z^2 - 1"), expression("sqrt(x^2 + 0.1) + y^2 + z^2 - 1")),
    ("crease", expression("x^2 + y^2 + z^2 - 1 + sin(abs(x))/4"), expression("x^2 + y^2 + z^2 - 1 + sin(abs(x)^3)/4")),
    ("crease", expression("exp(max(x, y)) + z^2 + x^2 + y^2 - 2"), expression("max(x, y) + z^2 + x^2 + y^2 - 1")),
    ("crease", {"surface": "superellipsoid", "e1": 2.0}, {"surface": "superellipsoid", "e1": 0.5}),
    ("crease", expression("x^2+y^2+z^2-1 + sin(abs(x))/4"), expression("x^2+y^2+z^2-1 + sin(abs(x - 1.5))/4")),
    ("crease", expression("(x^2+y^2+z^2-1)*(1 + abs(x)) + y/9"), expression("(x^2+y^2+z^2-1)*(1 + abs(x))")),
    *(
        ("jump", expression(f"max({jumping}, x^2+y^2+z^2-0.9)"), expression(f"max({smooth}, x^2+y^2+z^2-0.9)"))
        for jumping, smooth in (
            ("y - 0.3*sign(x)", "y - 0.3*sign(x - 2)"),
            ("z - 0.25*floor(4*x)", "z - abs(x)*sign(x)"),
            ("mod(x, 0.4) - 0.2", "(mod(x + 0.25, 0.5) - 0.25)^2 + y^2 - 0.04"),
        )
    ),
    ("jump", expression("max(atan2(z, y) + 2.9, x^2+y^2+z^2-0.5)"), expression("max(atan2(z, y+4), x^2+y^2+z^2-0.5)")),
    (
        "jump",
        expression(f"max({STAR.format('4.5')}, abs(z) - 0.3)"),
        expression(f"max({STAR.format('5')}, abs(z) - 0.3)"),
    ),
    (
        "fine",
        expression(f"max({CELLS.format(90)}, x^2+y^2+z^2-1)"),
        expression(f"max({CELLS.format(6)}, x^2+y^2+z^2-1)"),
    ),
    ("fine", expression(f"max({CELLS.format(90)}, x^2+y^2+z^2-1)"), expression("x^2+y^2+z^2-0.01")),
]


@pytest.mark.parametrize(("kind", "lens", "near_miss"), FOUND)
def test_a_hard_shape_is_named_and_a_near_miss_is_not(kind: str, lens: dict[str, Any], near_miss: Any) -> None:
    assert kind in kinds(make_scene(lens))
    assert kind not in kinds(make_scene(near_miss))


def test_the_catalogue_has_these_singular_shapes_and_no_others() -> None:
    found = {name: kinds(make_scene({"surface": name, "stretch": [0.4] * 3})) for name in CATALOGUE}
    assert {name for name, spots in found.items() if spots} == {"heart", "bifolia", "barth_sextic", "cone"}
    assert set().union(*found.values()) == {"singular"}


def spindle(R: float, r: float) -> list[tuple[float, float, float]]:
    height = math.sqrt(r * r - R * R)
    return [(0.0, 0.0, height), (0.0, 0.0, -height)]


def nodes() -> list[tuple[float, ...]]:
    """The 50 nodes of Barth's sextic that are not at infinity: corners of a dodecahedron and an icosidodecahedron."""
    t = (1 + math.sqrt(5)) / 2
    signs = list(itertools.product((1, -1), repeat=3))
    corners: list[Any] = list(signs)
    corners += [tuple(np.roll((0, a / t, b * t), k)) for a, b, _ in signs for k in range(3)]
    middles = [tuple(np.roll((a, 0, 0), k)) for a in (1, -1) for k in range(3)]
    middles += [tuple(np.roll((a / 2 * t, b / 2 / t, c / 2), k)) for a, b, c in signs for k in range(3)]
    return [tuple(map(float, each)) for each in {*corners, *middles}]


@pytest.mark.parametrize(
    ("lens", "expected"),
    [
        ({"surface": "heart"}, [(0.0, 0.0, 1.0), (0.0, 0.0, -1.0)]),
        ({"surface": "bifolia"}, [(0.0, 0.0, 0.0)]),
        ({"surface": "cone", "height": 0.6}, [(0.0, 0.0, 0.3)]),
        ({"surface": "torus", "R": 0.5, "r": 0.5}, [(0.0, 0.0, 0.0)]),
        *(({"surface": "torus", "R": R, "r": r}, spindle(R, r)) for R, r in ((0.5, 0.7), (0.3, 0.9), (1e-6, 2e-6))),
        *(({"surface": "torus", "R": R, "r": r}, spindle(R, r)) for R, r in ((3e5, 4e5), (0.5, 0.51))),
    ],
)
def test_singular_points_are_where_closed_forms_have_them(lens: dict[str, Any], expected: list[Any]) -> None:
    (made,) = make_scene(lens).lenses
    size = float(np.abs(np.array(made.surface.box(made.values))).max())
    found = singular_points(made)
    assert len(found) == len(expected)
    for point in expected:
        assert min(math.dist(point, other) for other in found) < 1e-4 * size


def test_the_barth_sextic_has_its_nodes() -> None:
    (lens,) = make_scene({"surface": "barth_sextic"}).lenses
    found = np.array(singular_points(lens))
    assert len(found) == 50
    assert len(nodes()) == 50
    for node in nodes():
        assert np.abs(found - node).max(axis=1).min() < 1e-4, node


def test_crease_points_lie_on_the_crease_and_on_the_surface() -> None:
    (lens,) = make_scene(expression("x^2 + y^2 + z^2 - 1 + sin(abs(x - 0.3*y))/4")).lenses
    points = np.array(crease_points(lens))
    assert len(points) > 20
    x, y, z = points.T
    np.testing.assert_allclose(x, 0.3 * y, atol=1e-8)
    np.testing.assert_allclose(x * x + y * y + z * z, 1.0, atol=1e-7)


@pytest.mark.parametrize("source", [None, {"kind": "parallel", "direction": [0.1, -0.2, -1.0]}])
def test_a_point_on_a_pixels_ray_stands_on_that_pixel(source: dict[str, Any] | None) -> None:
    film = {"right": [1.3, 0.2, 0.1], "down": [0.1, -1.1, 0.3], "size": [7, 5]}
    scene = make_scene({"surface": "sphere"}, source=source, film=film)
    pixels = np.arange(35)
    origins, directions = film_rays(scene, pixels)
    ahead = 3.0 if source is None else 5.0
    places = on_film(scene, origins + ahead * directions)
    np.testing.assert_allclose(places, np.stack([pixels % 7 + 0.5, pixels // 7 + 0.5], axis=1), atol=1e-9)
    if source is None:
        assert np.isnan(on_film(scene, origins - ahead * directions)).all()  # behind the source


@pytest.mark.parametrize("scale", [1e-6, 1.0, 1e6])
def test_the_point_and_the_pixel_that_looks_at_it_are_told_whatever_the_placement(scale: float) -> None:
    at = np.array([0.1, 0.05, 0.3]) * scale
    lens = {"surface": "cone", "height": 0.6, "centre": at.tolist(), "stretch": [0.5 * scale] * 3, "rotate": [30, 0, 0]}
    film = {"centre": [0, 0, 2.5 * scale], "right": [1.3 * scale, 0, 0], "down": [0, -1.3 * scale, 0], "size": [90, 60]}
    picture = {"corner": [-3 * scale, 3 * scale, -2.5 * scale], "right": [6 * scale, 0, 0], "down": [0, -6 * scale, 0]}
    source = {"kind": "point", "at": [0.0, 0.0, 4.0 * scale]}
    scene = make_scene(lens, film=film, picture=picture, source=source)
    (spot,) = [spot for spot in hard_spots(scene) if spot.kind == "singular"]
    tip = at + 0.15 * scale * np.array([0.0, -math.sin(math.radians(30)), math.cos(math.radians(30))])
    told = [float(part) for part in spot.message.partition("at (")[2].partition(")")[0].split(",")]
    assert told == pytest.approx(tip.tolist(), abs=1e-4 * scale)
    row, column = (int(part) for part in spot.message.partition("film pixel (")[2].partition(")")[0].split(","))
    o, d = film_rays(scene, np.array([row * 90 + column]))
    d = d[0] / np.linalg.norm(d[0])
    beside = np.linalg.norm(np.cross(tip - o[0], d))
    assert beside < 1.3 / 60 * (4 / 1.5) * scale  # a pixel's width there, or less
    away = scene.replace({"film.centre": [1.5 * scale, 0.0, 2.5 * scale]})
    assert "singular" not in kinds(away)


def test_what_is_not_seen_is_not_told_though_the_lens_is() -> None:
    heart = make_scene({"surface": "heart", "rotate": [0.0, 90.0, 0.0]})  # its axis along x
    assert "singular" in kinds(heart)
    close = heart.replace({"film.right": [0.2, 0.0, 0.0], "film.down": [0.0, -0.2, 0.0]})
    assert kinds(close) == set()
    placed = Placement.of(heart.lenses[0])
    ends = placed.centre + np.array(singular_points(heart.lenses[0])) @ placed.to_world.T
    assert np.isfinite(on_film(close, ends)).all()


@pytest.mark.parametrize("name", CATALOGUE)
def test_surfaces_of_the_catalogue_lack_no_values_where_a_user_writes_them(name: str) -> None:
    (lens,) = make_scene({"surface": name}).lenses
    asked = lens.surface.expression, tuple(sorted(lens.values.items())), lens.surface.box(lens.values)
    assert (_regions(*asked), _poles(*asked)) == (((0.0, ()), (0.0, ())), ())


@pytest.mark.parametrize(
    ("kind", "text"),
    [
        ("no-value", "max(sqrt(x + 0.5) - 1, x^2+y^2+z^2-0.7)"),
        ("overflow", "exp(400*(x^2+y^2+z^2)) - exp(200)"),
        ("pole", "max(x^2+y^2+z^2-0.5 + 0.001/(x - 0.31), x^2+y^2+z^2-0.9)"),
        ("pole", "max(x^2+y^2+z^2-0.5 + 0.001/(x*y - 0.02), x^2+y^2+z^2-0.9)"),
    ],
)
def test_where_a_value_is_said_to_be_lacking_rays_are_undecided(kind: str, text: str) -> None:
    """Of a film with a pixel in its middle, fine enough for a ray close to any place."""
    scene = make_scene({"surface": text, "bounds": [[-1.3] * 3, [1.3] * 3]}, film={"size": [41, 41]})
    (spot,) = [spot for spot in hard_spots(scene) if spot.kind == kind]
    assert all(words in spot.message for words in ("such as at (", "may end undecided. "))
    row, column = (int(part) for part in spot.message.partition("film pixel (")[2].partition(")")[0].split(","))
    status = trace(scene).status
    if kind != "no-value":  # there it is where rays come out of the part without a value, into the solid
        assert status[row, column] == RayStatus.UNDECIDED
    assert (status == RayStatus.UNDECIDED).any()
    assert (status == RayStatus.PICTURE).any()


def test_a_place_without_value_that_the_film_does_not_see_is_told_without_a_pixel() -> None:
    scene = make_scene(expression("max(sqrt(x + 1.9) - 2, x^2+y^2+z^2-0.7)"), film={"right": [0.2, 0.0, 0.0]})
    (spot,) = [spot for spot in hard_spots(scene) if spot.kind == "no-value"]
    assert "such as at (-2, 0, 0); rays there" in spot.message


LACKING = [  # expressions without a value in part of their bounds, and the operation and the operand to blame
    ("abs(z) - sqrt(1 - x^2 - y^2)", "the square root of 1 - x^2 - y^2 = "),
    ("x^2 + y^2 + z^2 - 1 + 0.1*log(z + 1.2)", "the logarithm of z + 1.2 = -"),
    ("x^2 + y^2 + pow(z, 1.5) - 1", "the power 1.5 of z = -"),
]


@pytest.mark.parametrize(("text", "blamed"), LACKING)
def test_what_lacks_a_value_is_named_and_what_is_advised_leaves_no_ray_undecided(text: str, blamed: str) -> None:
    def scene(surface: str) -> Any:
        return make_scene({"surface": surface, "bounds": [[-2.1] * 3, [2.1] * 3]}, film={"size": [24, 24]})

    (spot,) = [spot for spot in hard_spots(scene(text)) if spot.kind == "no-value"]
    assert f"There F holds {blamed}" in spot.message
    place, value = re.search(r"such as at \((.*?)\),.* = (\S+), in the lens's own", spot.message).groups()
    operand = parse(blamed.split(" of ")[1].rstrip("-").rstrip("= "), "xyz")
    told = dict(zip("xyz", map(float, place.split(", ")), strict=True))
    assert float(value) == pytest.approx(float(evaluate(operand, told)), rel=0.01)
    advice = re.search(r"write (?:pow\(abs.*?, or )?(.*) for it, and (.*) to end the solid", spot.message)
    guarded, ended = advice.groups()
    plain = re.sub(r"max\((.*), [\de.-]+\)(?=\)|,)", r"\1", guarded)  # as it stood there
    assert plain in text
    mended = scene(ended.replace("F", text.replace(plain, guarded)))
    raymap = trace(mended)
    assert not (raymap.status == RayStatus.UNDECIDED).any()
    assert (raymap.events > 0).sum() > 100
    assert "no-value" not in kinds(mended)


def test_places_without_a_value_are_not_taken_for_details_finer_than_a_pixel() -> None:
    stripes = expression("y^2 + z^2 + x^2 - 0.5 - sqrt(sin(20*x))")
    coarse = make_scene(stripes, film={"size": [18, 18], "right": [2.0, 0.0, 0.0], "down": [0.0, -2.0, 0.0]})
    assert "no-value" in {spot.kind for spot in hard_spots(coarse)}
    assert "fine" not in {spot.kind for spot in hard_spots(coarse)}


NOWHERE = [  # expressions of which nothing is in a cube of half side 2, and what is said
    ("(x - 5)^2 + y^2 + z^2 - 1", "Outside of them F is negative, as at (4.5, -0.5, -0.5): move lens.bounds"),
    ("0.25 + 30 - x^2 - y^2 - z^2", "if its sign is reversed, write -(F)"),
    ("x^2 + 1", "F is 1 at least, and no lens will be seen"),
    ("sqrt(-1 - x^2) + y", "F has no value at any of them"),
]


@pytest.mark.parametrize(("text", "says"), NOWHERE)
def test_a_solid_that_is_not_in_its_bounds_is_looked_for(text: str, says: str) -> None:
    scene = make_scene({"surface": text, "bounds": [[-2.0] * 3, [2.0] * 3]})
    (spot,) = [spot for spot in hard_spots(scene) if spot.kind == "no-inside"]
    assert spot.message.startswith("no point with F < 0 found in its bounds, at 35937 places: ")
    assert says in spot.message


PIXEL = 1.3 / 48 * 4.0 / 1.5  # of the usual film, at the world's origin


@pytest.mark.parametrize(
    ("lens", "width"),
    [
        ({"surface": "sphere", "r": 0.5 * PIXEL}, 1.0),
        ({"surface": "rod", "diameter": PIXEL, "length": 1.0, "rotate": [90.0, 0.0, 30.0]}, 1.0),
        ({"surface": "torus", "R": 0.4, "r": 0.5 * PIXEL}, 1.0),
        ({"surface": "torus", "R": 0.4, "r": 0.5 * PIXEL, "rotate": [0.0, 60.0, 0.0]}, 1.0),
    ],
)
def test_a_part_below_a_pixels_width_is_thin_and_one_above_is_not(lens: dict[str, Any], width: float) -> None:
    for factor, is_thin in ((0.4, True), (0.85, True), (1.3, False)):
        thinner = lens | {"stretch": [factor, factor, 1.0] if lens["surface"] == "rod" else [factor] * 3}
        scene = make_scene(thinner)
        assert ("thin" in kinds(scene)) is is_thin, factor
        if is_thin:
            (spot,) = [spot for spot in hard_spots(scene) if spot.kind == "thin"]
            told = float(spot.message.partition("it is ")[2].partition(" film")[0])
            assert told == pytest.approx(factor * width, rel=0.12)


BALL, PANE = "x^2 + y^2 + z^2 - 0.1", "max(abs(z) - {half}, x^2 + y^2 - 0.4)"


@pytest.mark.parametrize(
    ("text", "is_user_part_thin"),
    [
        (f"min({BALL}, {PANE})", True),
        (PANE, True),  # alone, in bounds that are much larger
        (f"max(min(x^2 + y^2 + z^2 - 0.3, abs(z) - {{half}}), {BALL} - 0.5)", True),
        (f"min(max(abs(x), max(abs(y), abs(z))) - 0.3, {PANE})", True),
        (f"min({BALL}, {PANE})".replace("- 0.4", "- 0.05"), False),  # within the ball
        (f"max({BALL} - 0.3, {{half}} - abs(z))", False),  # what is thin is the gap
    ],
)
def test_parts_of_an_expression_are_thin_where_a_pixel_is_wider(text: str, is_user_part_thin: bool) -> None:
    for factor, is_thin in ((0.4, True), (0.7, True), (1.2, False)):
        on_edge = expression(text.format(half=0.5 * factor * PIXEL)) | {"rotate": [90.0, 0.0, 0.0]}
        scene = make_scene(on_edge)
        assert ("thin" in kinds(scene)) is (is_thin and is_user_part_thin), factor
        assert "thin" not in kinds(scene.replace({"lens.rotate": [0.0, 0.0, 0.0]}))  # seen from its face
        if is_thin and is_user_part_thin:
            (spot,) = [spot for spot in hard_spots(scene) if spot.kind == "thin"]
            told = float(spot.message.partition("it is ")[2].partition(" film")[0])
            assert factor <= told < 1.35 * factor  # the side that is nearer to the source looks wider


def test_a_pane_seen_from_its_face_is_not_thin() -> None:
    assert kinds(make_scene({"surface": "sphere", "stretch": [0.5, 0.5, 1e-3]})) == set()
    edge = {"surface": "sphere", "stretch": [0.5, 0.5, 1e-3], "rotate": [90.0, 0.0, 0.0]}
    assert kinds(make_scene(edge)) == {"thin", "not-aimed-at"}


def test_what_is_named_is_hard_indeed() -> None:
    """Rays at a surface without slope are undecided; a ball below a pixel's width is not seen at all."""
    flat = trace(make_scene(expression(FLAT), film={"size": [9, 9]}))
    sound = trace(make_scene(expression("x^2 + y^2 + z^2 - 1"), film={"size": [9, 9]}))
    assert (sound.events > 0).sum() > 10
    assert set(flat.status[sound.events > 0]) == {RayStatus.UNDECIDED}
    assert not (trace(make_scene({"surface": "sphere", "r": 0.2 * PIXEL})).events > 0).any()
    tip = trace(make_scene({"surface": "cone"}, film={"size": [9, 9]}))
    assert tip.status[4, 4] == RayStatus.UNDECIDED


HARD = {
    "heart": {"singular"},  # its dimple and its tip
    "bifolia": {"singular"},  # its pinch
    "gallery": {"singular"},  # both, the nodes of the sextic, the tip of the cone
    "glass": {"singular"},  # its heart
    "bifolia-close": {"singular"},
    "bifolia-wide": {"singular"},
    "heart-close": {"singular"},
    "heart-wide": {"singular"},
    # How their solids lie
    "bubble": {"within-lens.ball"},
    "coin": {"within-lens.block"},
    "straw": {"overlap-lens.water", "overlap-lens.straw"},
    "doublet": {"touch-lens.flint"},
    **{name: {"cut-by-picture"} for name in ("paperweight", "lenticular", "window")},
    # Mirrors send light back: the picture is behind the eye, or in its plane; and the eye is in the kaleidoscope
    "mirrors/ball": {"behind"},
    "cube": {"before-film"},
    "kaleidoscope": {"source-inside", "cut-by-film"},
}


@pytest.mark.parametrize("path", sorted(CONFIGS.rglob("*.toml")), ids=lambda path: path.stem)
def test_the_shipped_studies_have_the_hard_spots_that_are_known(path: Any) -> None:
    spots, _ = study_hard_spots(load_study(path))
    in_folder = f"{path.parent.name}/{path.stem}"  # two studies are called ball
    assert {spot.kind for spot in spots} == HARD.get(in_folder, HARD.get(path.stem, set()))


def test_details_are_fine_by_the_pixels_that_see_them() -> None:
    scene = make_scene(expression(f"max({CELLS.format(90)}, x^2+y^2+z^2-1)"))
    assert "fine" in kinds(scene)
    assert "fine" not in kinds(scene.replace({"film.size": [1024, 1024]}))
    assert "fine" not in kinds(scene.replace({"film.scale": 0.05}))
    assert "fine" in kinds(scene.replace({"source.kind": "parallel", "source.direction": [0, 0, -1]}))
