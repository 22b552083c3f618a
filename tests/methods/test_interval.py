"""The method `interval` misses no crossing: against dense sampling, polynomial roots and closed forms."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from methods.searches import Search, box_rays
from numpy.typing import NDArray
from probe import plain_device
from scenes import CATALOGUE, make_scene

import lenscl
from lenscl import RayStatus, reference
from lenscl.expr import evaluate, number, polynomial, symbol
from lenscl.lenses import Surface, catalogue, user_surface
from lenscl.methods import choose

Array = NDArray[Any]
RAYS = 20_000
SAMPLES = 600
CUBE = ((-1.05, -1.05, -1.05), (1.05, 1.05, 1.05))
GYROID = "max(abs(sin(5*x)*cos(5*y) + sin(5*y)*cos(5*z) + sin(5*z)*cos(5*x)) - w, x^2 + y^2 + z^2 - 1)"
USERS = {
    "quartic": ("x**4 + y**4 + z**4 - k", {"k": 0.5}),
    "gyroid slab in a ball": (GYROID, {"w": 0.3}),
    "cube": ("max(abs(x), abs(y), abs(z)) - 1", {}),
    "cylinder": ("max(x^2 + y^2 - 0.5, abs(z) - 0.7)", {}),
    "two balls": ("max(x^2 + y^2 + (z - 0.6)^2, x^2 + y^2 + (z + 0.6)^2) - 1", {}),
    "union": ("min((x - 0.4)^2 + y^2 + z^2, (x + 0.4)^2 + y^2 + z^2) - 0.3", {}),
    "egg box": ("max(z - 0.2*exp(-x^2)*cos(6*x)*tanh(3*y), hypot(x, y) - 1, -z - 0.5)", {}),
    "cusps": ("x^2 + y^2 + z^2 - 0.7 - k*z*cbrt((x - 0.3)^2 + 4*y^2) + 0.1*cbrt(z^2)", {"k": 0.4}),
    "waves": ("max(cos(25*x)*cos(25*y) + 0.2*z, x^2 + y^2 + z^2 - 1)", {}),
}
NAMES = ("sphere", "torus", "bifolia", "heart", "superellipsoid", "barth_sextic", *USERS)


def surface_of(name: str) -> tuple[Surface, dict[str, float]]:
    if name in USERS:
        text, values = USERS[name]
        return user_surface(text, list(values), CUBE), dict(values)
    found = catalogue()[name]
    return found, {parameter.name: parameter.default for parameter in found.parameters}


def sampled(surface: Surface, values: dict[str, float], o: Array, d: Array, t: Array) -> Array:
    """Return F at places t, shape (N, M), along rays."""
    p = {axis: o[:, i, None] + t * d[:, i, None] for i, axis in enumerate("xyz")}
    return evaluate(surface.expression, {**values, **p})


@pytest.mark.parametrize("name", NAMES)
def test_no_sampled_inside_comes_before_the_first_root(name: str, request: pytest.FixtureRequest) -> None:
    count = RAYS if request.config.getoption("--slow") else RAYS // 4
    surface, values = surface_of(name)
    low, high = np.asarray(surface.box(values))
    o, d, length = box_rays((low - 1e-3, high + 1e-3), count, 3)
    roots = Search(surface, values)(o, d, length)

    first = np.full(count, np.inf)
    for part in np.array_split(np.arange(count), 20):
        t = (np.arange(SAMPLES) + 0.5) / SAMPLES * length[part, None]
        inside = sampled(surface, values, o[part], d[part], t) < -1e-13
        first[part] = np.where(inside.any(1), t[np.arange(len(part)), inside.argmax(1)], np.inf)

    assert np.isfinite(first).sum() > count // 10
    assert not (roots.undecided & np.isfinite(first)).any()
    assert roots.undecided.sum() <= count // 2000  # tangent to within rounding
    assert not (np.isfinite(first) & ~roots.found).any(), "missed events"
    late = roots.found & (roots.t > first)
    assert not late.any(), "events after the first"
    at_root = sampled(surface, values, o, d, roots.t[:, None])[:, 0]
    assert np.abs(at_root[roots.found]).max() < 1e-13


@pytest.mark.parametrize("name", ["sphere", "bifolia", "quartic"])
def test_first_roots_are_those_of_the_polynomial(name: str) -> None:
    surface, values = surface_of(name)
    low, high = np.asarray(surface.box(values))
    o, d, length = box_rays((low - 1e-3, high + 1e-3), RAYS, 5)
    roots = Search(surface, values)(o, d, length)

    along = {axis: (symbol(f"o{axis}"), symbol(f"d{axis}")) for axis in "xyz"}
    coefficients = polynomial(surface.expression, along)
    assert coefficients is not None
    rays = {f"o{a}": o[:, i] for i, a in enumerate("xyz")} | {f"d{a}": d[:, i] for i, a in enumerate("xyz")}
    numbers = np.stack([evaluate(number(0.0) + c, {**values, **rays}) for c in coefficients], 1)
    checked = 0
    for i in range(0, RAYS, 4):
        r = np.roots(numbers[i, ::-1])
        simple = [z.real for z in r if abs(z.imag) < 1e-9 and 0 <= z.real <= length[i]]
        near_double = any(abs(a - b) < 1e-5 for k, a in enumerate(r) for b in r[:k])
        if near_double or roots.undecided[i]:
            continue
        checked += 1
        assert roots.found[i] == bool(simple)
        if simple:
            assert roots.t[i] == pytest.approx(min(simple), abs=1e-9)
    assert checked > RAYS // 8


@pytest.mark.parametrize("thick", [10.0**-k for k in range(1, 10)])
def test_thin_solids_lose_no_chord(thick: float) -> None:
    rng = np.random.default_rng(11)
    slab = user_surface("z^2 - h^2", ["h"], ((-9, -9, -9), (9, 9, 9)))
    shell = user_surface("max(x^2 + y^2 + z^2 - 1, (1 - h)^2 - x^2 - y^2 - z^2)", ["h"], CUBE)
    d = rng.normal(size=(RAYS, 3))
    d /= np.linalg.norm(d, axis=1, keepdims=True)
    d[:, 2] = np.where(np.abs(d[:, 2]) < 0.05, 0.05, d[:, 2])  # a slab is met within the length
    o = np.stack([*rng.uniform(-1, 1, (2, RAYS)), -np.sign(d[:, 2]) * rng.uniform(0.5, 1, RAYS)], 1)
    cases = {
        "slab": (slab, {"h": thick}, o, d, np.full(RAYS, 40.0)),
        "shell": (shell, {"h": thick}, *box_rays(((-0.6,) * 3, (0.6,) * 3), RAYS, 2)),
        "disc": (catalogue()["ellipsoid"], {"a": 1.0, "b": 1.0, "c": thick, "r": 1.0}, o, d, np.full(RAYS, 40.0)),
    }
    for name, (surface, values, start, along, length) in cases.items():
        if name == "shell":
            start, length = start - 2.0 * along, length + 4.0
            hits = np.ones(RAYS, bool)  # through a cube inside the ball of radius 1 - h, from outside
            hits &= np.linalg.norm(start, axis=1) > 1.0
        elif name == "disc":
            crossing = start - start[:, 2:] / along[:, 2:] * along
            hits = np.linalg.norm(crossing[:, :2], axis=1) < 0.999  # through the middle plane inside the rim
        else:
            hits = np.ones(RAYS, bool)
        roots = Search(surface, values)(start, along, length)
        assert hits.sum() > RAYS // 100
        assert not (hits & ~roots.found & ~roots.undecided).any(), f"{name}: missed chords"
        assert (hits & roots.undecided).sum() == 0, name


@pytest.mark.parametrize("name", CATALOGUE)
def test_a_null_lens_is_the_identity_and_every_crossing_is_an_event(name: str) -> None:
    scene = make_scene(
        {"surface": name, "rotate": [20.0, 30.0, 40.0], "n": 1.33},
        medium=1.33,
        film={"size": [256, 256]},
        numerics={"method": "interval", "max_events": 40},
    )
    raymap = lenscl.trace(scene)
    origin, direction = reference.film_rays(scene)
    st, _ = reference.land(origin, direction, scene.picture)
    decided = raymap.status.ravel() == RayStatus.PICTURE
    assert (~decided).sum() <= 3
    assert (raymap.events > 0).sum() > 5000
    assert (raymap.events.ravel()[decided] % 2 == 0).all()
    assert np.abs(raymap.st.reshape(-1, 2) - st)[decided].max() <= 1e-12


@pytest.mark.parametrize("name", ["torus", "heart", "bifolia", "superellipsoid"])
def test_a_source_inside_leaves_through_every_crossing(name: str) -> None:
    surface, values = surface_of(name)
    low, high = np.asarray(surface.box(values))
    rng = np.random.default_rng(2)
    o = rng.uniform(low, high, (RAYS, 3))
    inside = evaluate(surface.expression, {**values, **dict(zip("xyz", o.T, strict=True))}) < -1e-9
    o = o[inside][:4000]
    d = rng.normal(size=o.shape)
    d /= np.linalg.norm(d, axis=1, keepdims=True)
    t = np.linspace(0, 4, 2000)[None]
    f = sampled(surface, values, o, d, np.broadcast_to(t, (len(o), 2000)))
    crossings = (np.sign(f[:, 1:]) != np.sign(f[:, :-1])).sum(1)
    scene = make_scene({"surface": name, "n": 1.2, **values}, medium=1.2, numerics={"method": "interval"})
    paths = lenscl.trace_rays(scene, o, d)
    decided = paths.status != RayStatus.UNDECIDED
    assert len(o) > 1000
    assert (~decided).sum() <= 2
    assert (paths.events[decided] >= crossings[decided]).all(), "every sampled crossing is an event"
    assert (paths.events[decided] % 2 == 1).all()
    assert (paths.events[decided] == crossings[decided]).mean() > 0.99


@pytest.mark.parametrize("power", [-20, 20])
@pytest.mark.parametrize("name", ["torus", "heart", "superellipsoid"])
def test_scaling_a_scene_by_a_power_of_two_changes_no_bit(name: str, power: int) -> None:
    k = 2.0**power

    def scaled(k: float) -> Any:
        return make_scene(
            {"surface": name, "rotate": [30.0, 20.0, 10.0], "stretch": [k, k, k]},
            source={"kind": "point", "at": [0.0, 0.0, 4.0 * k]},
            film={"centre": [0.0, 0.0, 2.5 * k], "right": [k, 0.0, 0.0], "down": [0.0, -k, 0.0]},
            picture={"corner": [-3 * k, 3 * k, -2.5 * k], "right": [6 * k, 0.0, 0.0], "down": [0.0, -6 * k, 0.0]},
            numerics={"method": "interval"},
        )

    one, other = lenscl.trace(scaled(1.0)), lenscl.trace(scaled(k))
    assert (one.events > 0).sum() > 500
    np.testing.assert_array_equal(one.status, other.status)
    np.testing.assert_array_equal(one.events, other.events)
    np.testing.assert_array_equal(one.st, other.st)


@pytest.mark.parametrize("precision", ["single", "double"])
def test_every_packet_width_and_precision_agrees_with_the_march(precision: str) -> None:
    scene = make_scene(
        {"name": "near", "surface": "heart", "centre": [0.0, 0.0, 1.0]},
        {"name": "far", "surface": "torus", "centre": [0.0, 0.0, -1.0]},
        film={"size": [96, 96]},
        numerics={"step": 1e-3},
    )
    march = lenscl.trace(scene, method="march", precision="double")
    for widths in ((1, 1), (4, 2), (16, 8)):
        found = lenscl.trace(scene, method="interval", precision=precision, device=plain_device(*widths))
        same = (found.events == march.events) & (found.status == march.status)
        assert same.mean() > 0.995
        both = same & (march.status == RayStatus.PICTURE) & (march.events > 0)
        assert both.sum() > 300
        error = np.abs(found.st - march.st)[both].max(-1)
        assert np.quantile(error, 0.99) < {"single": 1e-3, "double": 1e-9}[precision]


def test_what_is_not_a_number_or_touches_is_undecided_or_right() -> None:
    root = user_surface("sqrt(x) - 0.5", [], CUBE)
    o = np.array([[-1.0, 0.0, 0.0], [1.0, 0.0, 0.0], [1.0, 0.1, 0.0], [1.0, 0.0, 0.3]])
    d = np.array([[1.0, 0.0, 0.0], [-1.0, 0.0, 0.0], [-0.3, 1.0, 0.0], [0.0, 1.0, 0.0]])
    roots = Search(root, {})(o, d, np.array([2.0, 0.9, 1.0, 1.0]))
    assert roots.undecided.tolist() == [True, False, False, False]
    assert roots.found.tolist() == [False, True, False, False]
    assert roots.t[1] == 0.75

    # Rays past a sphere at an impact parameter of 1 +- 2^-k: decided and right until rounding forbids it
    k = np.arange(1, 53)
    for side in (1.0, -1.0):
        height = 1.0 + side * 2.0**-k
        o = np.stack([height, 0 * height, -1.0 + 0 * height], 1)
        roots = Search(*surface_of("sphere"))(o, np.tile([0.0, 0.0, 1.0], (52, 1)), np.full(52, 2.0))
        assert not (roots.found & roots.undecided).any()
        assert (roots.undecided | (roots.found == (side < 0))).all()
        assert not roots.undecided[k < 42].any()


def test_auto_takes_the_first_guaranteed_method_that_serves_a_surface() -> None:
    assert choose("auto", is_polynomial=False).name == "interval"
    assert choose("auto", is_polynomial=True).name == "polynomial"
    assert choose("polynomial", is_polynomial=False) is None
    assert choose("interval", is_polynomial=False).reads == ()


def test_a_root_on_which_a_segment_happens_to_end_is_found() -> None:
    """What is left of such a segment is a few units in the last place: too little for a proof on its own."""
    scene = make_scene({"surface": "plano_convex", "n": 1.0})
    low, high = np.array(scene.lenses[0].surface.box(scene.lenses[0].values))
    rng = np.random.default_rng(0)
    d = rng.normal(size=(400_000, 3))
    d /= np.linalg.norm(d, axis=1, keepdims=True)
    paths = lenscl.trace_rays(scene, rng.uniform(low, high, (400_000, 3)) - 3.0 * d, d, method="interval")
    assert (paths.events == 2).mean() > 0.7
    assert not (paths.status == RayStatus.UNDECIDED).any()


BROKEN = {
    "the band's rise is left out": (" - abs_v(band.rise) - band.error", " - band.error"),
    "the band's error is left out": ("- abs_v(band.rise) - band.error >=", "- abs_v(band.rise) >="),
    "the slope's error is left out": ("sloped + doubt, bent, true", "sloped, bent, true"),
    "the slope does not bend": ("const realv bends = -sign * slope.rise;", "const realv bends = (realv)0;"),
    "the ray starts too high": (
        "const realv level = sign * start.mid - start.error;",
        "const realv level = (realv)2 * sign * start.mid;",
    ),
    "one leaf's sign is taken for F's": (
        "side * SURFACE(joined)(sight->holds), (realv)0)",
        "abs_v(sight->holds[0]), (realv)0)",
    ),
    "leaves that may flip before are forgotten": ("flips += one_step(may);", "flips = (maskv)1;"),
}


@pytest.mark.parametrize("fault", BROKEN)
def test_a_fault_in_the_search_is_seen(fault: str) -> None:
    old, new = BROKEN[fault]

    def edit(text: str) -> str:
        assert old in text
        return text.replace(old, new)

    wrong = 0
    for name in ("waves", "gyroid slab in a ball", "torus"):
        surface, values = surface_of(name)
        o, d, length = box_rays(CUBE, RAYS, 3)
        right, other = (Search(surface, values, edit=each)(o, d, length) for each in (str, edit))
        wrong += int((right.found & (~other.found | (np.abs(other.t - right.t) > 1e-9))).sum())
        if wrong > 10:
            break
    assert wrong > 10


def test_a_ray_that_departs_meets_the_other_side_and_never_where_it_stands() -> None:
    surface, values = surface_of("sphere")
    o, d, length = box_rays(surface.box(values), RAYS, 3)
    first = Search(surface, values)(o, d, length)
    hit = first.found & (first.t > 0.1)
    p, v = (o + first.t[:, None] * d)[hit], d[hit]
    assert hit.sum() > 1000

    across = Search(surface, values)(p, v, 3.0, True, True)
    assert across.found.all()
    assert np.abs(across.t + 2 * np.sum(p * v, 1)).max() < 1e-12

    # One that is said to travel inside but goes out contradicts itself; forgetting the known root would find it
    def edit(text: str) -> str:
        assert "maskv on_root = search.departs;" in text
        return text.replace("maskv on_root = search.departs;", "maskv on_root = (maskv)0;")

    outward = Search(surface, values)(p, -v, 3.0, True, True)
    assert outward.undecided.all()
    assert not outward.found.any()
    again = Search(surface, values, edit=edit)(p, -v, 3.0, True, True)
    assert (again.found & (again.t < 1e-12)).sum() > 1000
