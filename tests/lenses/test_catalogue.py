from __future__ import annotations

import copy
import math
import pickle

import numpy as np
import pytest
from scenes import EVERY

from lenscl.errors import LensclError
from lenscl.expr import bounds, evaluate, evaluate_with_error, gradient, parse
from lenscl.lenses import catalogue, surface

_EVEN = ("A4", "A6", "A8", "B4", "B6", "B8")
CASES = [
    ("sphere", {"r": 1.0}),
    ("sphere", {"r": 1e-3}),
    ("ellipsoid", {"a": 1.0, "b": 0.8, "c": 0.6, "r": 1.0}),
    ("ellipsoid", {"a": 1.0, "b": 1e-3, "c": 50.0, "r": 0.5}),
    ("torus", {"R": 0.7, "r": 0.25}),
    ("torus", {"R": 0.5, "r": 0.5}),
    ("torus", {"R": 0.3, "r": 0.8}),
    ("torus", {"R": 5.0, "r": 0.1}),
    ("heart", {}),
    ("bifolia", {}),
    ("barth_sextic", {"w": 1.0, "clip": 1.8}),
    ("barth_sextic", {"w": 0.6, "clip": 0.5}),
    ("barth_sextic", {"w": 0.5, "clip": 3.0}),
    *(
        ("superellipsoid", {"e1": e1, "e2": e2})
        for e1, e2 in [(0.5, 0.5), (0.2, 0.2), (2.0, 0.2), (0.2, 2.0), (2, 2), (1, 1)]
    ),
    ("biconvex", {"R1": 1.5, "R2": 1.2, "thickness": 0.6, "diameter": 1.4}),
    ("biconvex", {"R1": 0.5, "R2": 0.7, "thickness": 3.0, "diameter": 1.0}),  # longer than its balls
    ("biconvex", {"R1": 1e4, "R2": 2e4, "thickness": 0.01, "diameter": 1.4}),
    ("plano_convex", {"R": 1.0, "thickness": 0.45, "diameter": 1.4}),
    ("plano_convex", {"R": 0.7, "thickness": 0.7, "diameter": 1.4}),  # half a ball
    ("meniscus", {"R1": 0.9, "R2": 1.8, "thickness": 0.4, "diameter": 1.4}),
    ("meniscus", {"R1": 1.8, "R2": 0.75, "thickness": 0.02, "diameter": 1.4}),
    ("ball", {"diameter": 1.4}),
    ("rod", {"diameter": 0.8, "length": 1.4}),
    ("prism", {"apex": 60.0, "side": 1.2, "length": 1.2}),
    ("prism", {"apex": 110.0, "side": 0.7, "length": 0.6}),
    ("cone", {"diameter": 1.4, "height": 0.4}),
    ("conic_singlet", {"c1": 0.8, "k1": -1.0, "c2": 0.0, "k2": 0.0, "thickness": 0.3, "diameter": 1.4}),
    ("conic_singlet", {"c1": -1.0, "k1": -3.0, "c2": 1.2, "k2": 0.3, "thickness": 0.1, "diameter": 1.4}),
    ("conic_singlet", {"c1": -1.0, "k1": 0.0, "c2": -1.1, "k2": -2.0, "thickness": 0.6, "diameter": 1.8}),
    *(
        ("even_asphere_singlet", {"c1": c1, "k1": k1, "c2": c2, "k2": k2, "thickness": 0.5, "diameter": 1.4} | even)
        for c1, k1, c2, k2, even in [
            (0.8, 0.0, -0.4, 0.0, dict(zip(_EVEN, (0.1, -0.05, 0.0, 0.05, 0.0, 0.1), strict=True))),
            (0.0, 0.0, 0.5, -1.0, dict(zip(_EVEN, (-0.3, 0.4, 0.0, -0.2, -0.1, 0.1), strict=True))),
            (0.9, -0.5, 0.0, 0.0, dict(zip(_EVEN, (-0.9, 0.5, 0.0, 0.0, 0.0, 0.0), strict=True))),  # gull wing
        ]
    ),
    ("biconcave", {"R1": 1.5, "R2": 0.9, "thickness": 0.1, "diameter": 1.4}),
    ("half_ball", {"diameter": 1.4}),
    ("drum", {"diameter": 0.9, "length": 1.4}),
    (
        "cylindrical_singlet",
        {"c1": 0.8, "k1": -1.0, "c2": -0.4, "k2": 0.5, "thickness": 0.5, "width": 0.6, "height": 1},
    ),
    ("cylindrical_singlet", {"c1": -1, "k1": 0.0, "c2": 0.0, "k2": 0.0, "thickness": 0.1, "width": 0.8, "height": 1.2}),
    ("toroidal_singlet", {"c1x": 0.8, "c1y": 0.4, "c2x": 0.0, "c2y": -0.3, "thickness": 0.5, "diameter": 1.4}),
    ("toroidal_singlet", {"c1x": -0.9, "c1y": 0.6, "c2x": 0.3, "c2y": 0.0, "thickness": 0.6, "diameter": 1.4}),
    ("asphere_singlet", {"c1": 0.8, "k1": -1.0, "c2": -0.4, "k2": 0.0, "thickness": 0.5, "diameter": 1.4}),
    ("box", {"a": 0.5, "b": 1.0, "c": 0.2}),
    ("wedge", {"angle": 10.0, "thickness": 0.3, "width": 0.7, "height": 1.2}),
    ("polyhedron", {}),
    (
        "brilliant",
        {"diameter": 1.4, "table": 57.0, "crown_angle": 34.5, "pavilion_angle": 40.75, "girdle": 3.0}
        | {"star": 50.0, "lower": 77.0},
    ),
]
# Whose formulas are no expressions; rays through them are compared with closed forms
IN_WORDS = ("toroidal_singlet", "asphere_singlet", "polyhedron", "brilliant")
EACH = pytest.mark.parametrize(
    ("name", "values"), CASES, ids=lambda v: v if isinstance(v, str) else "-".join(map(str, v.values()))
)
SIDE = 401  # samples along an edge of a slice; odd, so that the axes are among them


def _slices(low, high, axis, at):
    ticks = [np.array([at]) if k == axis else np.linspace(low[k], high[k], SIDE) for k in range(3)]
    return dict(zip("xyz", np.meshgrid(*ticks, indexing="ij"), strict=True))


@EACH
def test_the_box_holds_the_solid_and_no_face_can_be_moved_in_by_a_thousandth(name, values):
    row = surface(name)
    low, high = (np.array(corner) for corner in row.box(values))
    size = high - low
    far_low, far_high = low - size, high + size
    for axis in range(3):
        for end, outward in ((low[axis], -1.0), (high[axis], 1.0)):
            for beyond in (0.0, 1e-3, 0.03, 0.3, 0.99):
                outside = evaluate(
                    row.expression, {**values, **_slices(far_low, far_high, axis, end + outward * beyond * size[axis])}
                )
                assert (outside > 0.0).all(), f"{name} reaches out of its box at {axis}, {end}"
            margin = 2e-6 * size.max()  # samples begin just within it, where a sharp edge is still thick enough
            inside = evaluate(
                row.expression,
                {**values, **_slices(low + margin, high - margin, axis, end - outward * (1e-3 * size[axis] + margin))},
            )
            assert (inside <= 0.0).any(), f"the box of {name} is not tight at {axis}, {end}"


def _printed(name, formula, values):
    """The formula as books print it, by Python's own arithmetic on numpy arrays; infinite beyond a sag's domain."""
    formula, _, sag = formula.replace("^", "**").partition("; ")
    names = {
        **{"sqrt": np.sqrt, "hypot": np.hypot, "abs": np.abs, "t": (1 + math.sqrt(5)) / 2, **values},
        **{"max": lambda *each: np.max(np.broadcast_arrays(*each), 0)},
        **{"sin": lambda a: math.sin(math.radians(a)), "cos": lambda a: math.cos(math.radians(a))},
        **{"tan": lambda a: math.tan(math.radians(a))},
    }

    def at(x, y, z):
        def depth(*of):
            bend = dict(zip(("R",) if "sag(R)" in sag else ("c", "k", "A4", "A6", "A8"), of, strict=False))
            text = sag.partition("= ")[2].partition(", r**2 =")[0]
            found = eval(text, {"__builtins__": {}}, {**names, **bend, "r": np.hypot(x, y), "x": x, "y": y})
            return np.where(np.isnan(found), np.inf, found)

        with np.errstate(invalid="ignore"):
            return eval(formula, {"__builtins__": {}}, {**names, "sag": depth, "x": x, "y": y, "z": z})

    return at


@pytest.mark.parametrize(("name", "values"), [case for case in CASES if case[0] not in IN_WORDS])
def test_the_form_has_the_sign_of_the_printed_formula(name, values):
    row = surface(name)
    rng = np.random.default_rng(1)
    low, high = (np.array(corner)[:, None] for corner in row.box(values))
    x, y, z = low + (high - low) * rng.uniform(-0.1, 1.1, (3, 20_000))
    form = evaluate(row.expression, {**values, "x": x, "y": y, "z": z})
    printed = np.asarray(_printed(name, row.formula, values)(x, y, z))
    if name == "barth_sextic":
        printed = np.where(x**2 + y**2 + z**2 > values["clip"] ** 2, 1.0, printed)
    sure = np.abs(printed) > 1e-12
    assert (np.sign(form[sure]) == np.sign(printed[sure])).all()
    assert (form[sure] < 0).sum() > 500
    assert (form[sure] > 0).sum() > 500


def _surface_points(row, values, count):
    """Points of the surface by bisection between a point inside and one outside."""
    rng = np.random.default_rng(2)
    low, high = (np.array(corner)[:, None] for corner in row.box(values))
    points = low + (high - low) * rng.uniform(-0.2, 1.2, (3, 400_000 if row.name == "torus" else 40_000))
    F = evaluate(row.expression, {**values, **dict(zip("xyz", points, strict=True))})
    inside, outside = points[:, F < 0.0], points[:, F > 0.0]
    count = min(count, inside.shape[1], outside.shape[1])
    a, b = inside[:, :count].copy(), outside[:, :count].copy()
    for _ in range(80):
        middle = 0.5 * (a + b)
        within = evaluate(row.expression, {**values, **dict(zip("xyz", middle, strict=True))}) <= 0.0
        a, b = np.where(within, middle, a), np.where(within, b, middle)
    return a


@EACH
def test_the_gradient_is_finite_and_not_zero_on_the_surface_and_points_outward(name, values):
    row = surface(name)
    points = _surface_points(row, values, 500)
    at = {**values, **dict(zip("xyz", points, strict=True))}
    slope = np.stack([np.broadcast_to(evaluate(each, at), points.shape[1:]) for each in gradient(row.expression)])
    length = np.linalg.norm(slope, axis=0)
    size = max(b - a for a, b in zip(*row.box(values), strict=True))
    assert points.shape[1] > 200
    assert np.isfinite(slope).all()
    assert (length > 0.0).all()
    # A step along the normal, small against the thinnest part, leaves the solid
    step = 1e-7 * size * slope / length if name != "ellipsoid" else 1e-7 * min(values.values()) * slope / length
    beyond = evaluate(row.expression, {**values, **dict(zip("xyz", points + step, strict=True))})
    assert (beyond > 0.0).mean() > 0.995  # not where the solid has an edge or a second sheet within the step


@EACH
def test_the_gradient_agrees_with_differences_of_the_form(name, values):
    row = surface(name)
    rng = np.random.default_rng(3)
    low, high = (np.array(corner)[:, None] for corner in row.box(values))
    points = low + (high - low) * rng.uniform(0.02, 0.98, (3, 2000))

    def form(at):
        return evaluate(row.expression, {**values, **dict(zip("xyz", at, strict=True))})

    for axis, slope in enumerate(gradient(row.expression)):
        got = evaluate(slope, {**values, **dict(zip("xyz", points, strict=True))})
        width = float(high[axis, 0] - low[axis, 0])
        ahead, behind = points.copy(), points.copy()
        ahead[axis] += 1e-6 * width
        behind[axis] -= 1e-6 * width
        want = (form(ahead) - form(behind)) / (ahead[axis] - behind[axis])
        scale = np.abs(want).max() + np.abs(form(points)).max() / width
        close = np.abs(got - want) <= 1e-5 * scale
        assert close.sum() >= 1950  # a difference across an edge between branches tells nothing
        slopes = np.abs(want) > 1e-4 * scale  # of a face that lies along the axis nothing is told
        assert (slopes & (np.abs(2 * got - want) > 1e-5 * scale)).sum() > 20  # the twin, twice the gradient


def test_the_heart_has_a_simple_root_and_a_normal_on_its_equator():
    row = surface("heart")
    turn = np.linspace(0.0, 2 * np.pi, 100)
    at = {"x": np.cos(turn) / math.sqrt(2), "y": np.sin(turn) / math.sqrt(2), "z": 0.0}
    slope = np.stack([evaluate(each, at) for each in gradient(row.expression)])
    np.testing.assert_allclose(evaluate(row.expression, at), 0.0, atol=1e-15)
    # In closed form: (4x, 4y, -cbrt(x^2/10 + y^2))
    want = np.stack([4 * at["x"], 4 * at["y"], -np.cbrt(at["x"] ** 2 / 10 + at["y"] ** 2)])
    np.testing.assert_allclose(slope, want, rtol=1e-14, atol=1e-15)


@pytest.mark.parametrize("r", [0.25, 1e-3, 1e-5])
def test_a_thin_torus_is_as_sharp_as_a_thick_one(r):
    """The distance by which rounding moves the surface: |F error| / |grad F|, on exact points of the surface."""
    row, R = surface("torus"), 0.7
    rng = np.random.default_rng(4)
    around, along = rng.uniform(0.0, 2 * np.pi, (2, 500))
    ring = R + r * np.cos(along)
    at = {"R": R, "r": r, "x": ring * np.cos(around), "y": ring * np.sin(around), "z": r * np.sin(along)}
    length = np.linalg.norm([evaluate(each, at) for each in gradient(row.expression)], axis=0)
    assert (np.abs(evaluate(row.expression, at)) / length).max() < 1e-15
    assert (evaluate_with_error(row.expression, at)[1] / length).max() < 2e-15
    # The twin: the quartic as printed loses digits as R / r
    quartic = parse("(x^2 + y^2 + z^2 + R^2 - r^2)^2 - 4*R^2*(x^2 + y^2)", ["x", "y", "z", "R", "r"])
    lost = (np.abs(evaluate(quartic, at)) / length).max()
    assert lost > 1e-12 or r > 1e-4


def test_a_spindle_torus_is_filled():
    row, values = surface("torus"), {"R": 0.3, "r": 0.8}
    rng = np.random.default_rng(5)
    x, y, z = rng.uniform(-1.2, 1.2, (3, 50_000))
    inside = evaluate(row.expression, {**values, "x": x, "y": y, "z": z}) < 0.0
    ring = np.hypot(np.hypot(x, y) - 0.3, z) < 0.8  # within r of the circle
    np.testing.assert_array_equal(inside, ring)
    quartic = parse("(x^2 + y^2 + z^2 + R^2 - r^2)^2 - 4*R^2*(x^2 + y^2)", ["x", "y", "z", "R", "r"])
    hollow = ring & (evaluate(quartic, {**values, "x": x, "y": y, "z": z}) > 0.0)
    assert hollow.sum() > 500  # the quartic alone has a second sheet there


def test_bifolia_touches_its_axis_and_never_enters_there():
    row = surface("bifolia")
    y = np.linspace(-1.0, 1.0, 101)
    assert (evaluate(row.expression, {"x": 0.0, "y": y, "z": 0.0}) >= 0.0).all()


def test_the_barth_sextic_is_solid_at_the_origin():
    for w, clip in [(1.0, 1.8), (0.5, 0.1), (2.0, 9.0)]:
        assert evaluate(surface("barth_sextic").expression, {"w": w, "clip": clip, "x": 0, "y": 0, "z": 0}) < 0.0


@pytest.mark.parametrize(("e1", "e2"), [(0.2, 0.2), (0.2, 2.0), (2.0, 0.2), (1.0, 1.0), (2.0, 2.0), (0.7, 1.3)])
def test_the_superellipsoid_has_values_and_slopes_on_its_axes_planes_and_diagonals(e1, e2):
    row = surface("superellipsoid")
    special = np.array([0.0, 1e-30, 1e-8, 0.5, 1.0])
    x, y, z = (part.ravel() for part in np.meshgrid(*[np.concatenate([-special, special])] * 3))
    at = {"e1": e1, "e2": e2, "x": x, "y": y, "z": z}
    F = evaluate(row.expression, at)
    slope = np.stack([evaluate(each, at) for each in gradient(row.expression)])
    assert np.isfinite(F).all()
    assert np.isfinite(slope).all()
    assert F.size == 1000
    # A norm: its slope along the point is its value
    held = x * slope[0] + y * slope[1] + z * slope[2]
    np.testing.assert_allclose(held, F + 1.0, rtol=1e-12, atol=1e-12)


@EACH
def test_interval_bounds_over_the_box_hold_the_surface(name, values):
    row = surface(name)
    low, high = row.box(values)
    box = dict(zip("xyz", zip(low, high, strict=True), strict=True)) | {k: (v, v) for k, v in values.items()}
    least, most = bounds(row.expression, box)
    assert least < 0.0 < most


def test_every_row_is_complete():
    rows = catalogue()
    assert tuple(rows) == EVERY
    assert {name for name, _ in CASES} == set(rows)
    for name, row in rows.items():
        assert row.name == row.key == name
        assert row.summary
        assert row.source
        assert row.formula
        values = {parameter.name: parameter.default for parameter in row.parameters}
        assert list(row.problems(values)) == []
        assert all(parameter.meaning for parameter in row.parameters)
        names = {*"xyz", *values}
        assert not row.expression.depends_on({"R", "r", "w", "a"} - names)


def test_defaults_are_the_contracts():
    defaults = {row.name: {p.name: p.default for p in row.parameters} for row in catalogue().values()}
    assert defaults["sphere"] == {"r": 1.0}
    assert defaults["ellipsoid"] == {"a": 1.0, "b": 1.0, "c": 1.0, "r": 1.0}
    assert defaults["torus"] == {"R": 0.7, "r": 0.25}
    assert defaults["barth_sextic"] == {"w": 1.0, "clip": 1.8}
    assert defaults["heart"] == defaults["bifolia"] == {}


@pytest.mark.parametrize(
    ("name", "values", "wrong"),
    [
        ("torus", {"R": 0.7, "r": 0.0}, {"r": "more than 0"}),
        ("torus", {"R": -1.0, "r": -0.1}, {"R": "more than 0", "r": "more than 0"}),
        ("torus", {"R": math.nan, "r": 0.1}, {"R": "finite"}),
        ("sphere", {"r": math.inf}, {"r": "finite"}),
        ("superellipsoid", {"e1": 0.1, "e2": 2.5}, {"e1": "at least 0.2 and at most 2", "e2": "at most 2"}),
        ("superellipsoid", {"e1": 0.2, "e2": 2.0}, {}),
    ],
)
def test_values_out_of_range_are_all_named(name, values, wrong):
    found = dict(surface(name).problems(values))
    assert found.keys() == wrong.keys()
    for key, message in wrong.items():
        assert message in found[key]


def test_an_unknown_name_is_told_the_nearest():
    with pytest.raises(LensclError, match="did you mean 'torus'"):
        surface("tours")
    with pytest.raises(LensclError, match="known are sphere"):
        surface("qqq")


def test_surfaces_can_be_sent_to_another_process():
    for row in catalogue().values():
        again = pickle.loads(pickle.dumps(row))
        assert again == row
        assert again.expression is row.expression
        assert copy.deepcopy(row) == row


@pytest.mark.parametrize("name", [name for name, row in catalogue().items() if row.is_convex])
def test_what_is_called_convex_holds_the_middle_of_any_two_of_its_points(name):
    row = surface(name)
    values = {parameter.name: parameter.default for parameter in row.parameters}
    rng = np.random.default_rng(6)
    low, high = np.asarray(row.box(values))
    p = rng.uniform(low, high, (40_000, 3))
    inside = p[evaluate(row.expression, {**values, **dict(zip("xyz", p.T, strict=True))}) <= 0]
    assert len(inside) > 5000
    middle = (inside + inside[::-1]) / 2
    assert (evaluate(row.expression, {**values, **dict(zip("xyz", middle.T, strict=True))}) <= 0).all()


def test_the_convex_are_those_that_are():
    assert {name for name, row in catalogue().items() if row.is_convex} == {
        "sphere", "ellipsoid", "biconvex", "plano_convex", "ball", "rod", "prism", "cone",
        "superellipsoid", "half_ball", "drum", "box", "wedge", "polyhedron", "brilliant"
    }  # fmt: skip
