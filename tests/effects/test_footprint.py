"""The footprint of a film pixel: against differences of rays beside, closed forms, and with its formulas broken."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from effects.slopes import slopes
from faults_in_kernels import Fault, broken
from numpy.typing import NDArray
from probe import FORMS, optimised_device, plain_device
from scenes import CATALOGUE, make_scene
from thinned import thinned

from lenscl import RayStatus, trace, trace_rays
from lenscl.config import Scene
from lenscl.tracing import film_rays, job

WIDE = [[-2.2] * 3, [2.2] * 3]
SLANTED = {"kind": "parallel", "direction": [0.1, 0.05, -1.0]}
PLACED: dict[str, Any] = {"stretch": [1.1, 0.7, -0.9], "rotate": [20, 30, 40], "centre": [0.1, 0.05, 0.2]}
CUT = "max(x^2 + y^2 + (z + 0.8)^2 - 1.5, max(x^2 + y^2 - 0.5, exp(0.3*x)*z - 0.6 - 0.2*sin(3*y)))"
FOLLOWS = {"total_reflection": "follow"}
# Lenses, the rest of the scene, how many of 24 x 24 rays are compared at least, and events of paths among them
SCENES: dict[str, tuple[tuple[dict[str, Any], ...], dict[str, Any], int, set[int]]] = {
    "torus": (({"surface": "torus", **PLACED},), {}, 60, {2, 4}),
    "heart": (({"surface": "heart", "rotate": [80, 10, 5], "stretch": [0.8] * 3},), {}, 50, {2}),
    "bifolia": (({"surface": "bifolia", "rotate": [10, 10, 5], "stretch": [0.9, 0.8, 0.9]},), {}, 25, {2, 3}),
    "solid of three faces": (({"surface": CUT, "bounds": WIDE, "rotate": [60, 20, 0]},), {"source": SLANTED}, 60, {2}),
    "expression": (
        ({"surface": "x^4 + y^4 + z^4 - k + 0.1*cos(4*x)*tanh(y)", "k": 0.4, "bounds": WIDE},),
        {"film": {"right": [1.0, 0.2, 0.1], "down": [0.1, -1.2, 0.2]}},
        90, {2},
    ),
    "parallel light, many reflections": (
        ({"surface": "ellipsoid", "a": 1.0, "b": 0.8, "c": 0.5},), {"source": SLANTED, "effects": FOLLOWS},
        400, {2, 10},
    ),
    "bubble that reflects": (
        ({"surface": "ellipsoid", "a": 0.7, "b": 0.5, "c": 1.0, "n": 0.7},), {"effects": FOLLOWS}, 40, {1, 2}
    ),
    "two lenses": (
        (
            {"surface": "torus", "name": "ring", "rotate": [10, 0, 0]},
            {"surface": "sphere", "name": "egg", "r": 0.6, "centre": [0.1, 0.0, -1.4], "stretch": [1.0, 1.2, 0.8]},
        ),
        {"medium": 1.1, "picture": {"right": [6.0, 1.0, 0.5], "down": [1.0, -6.0, 0.7]}}, 90, {2, 4},
    ),
    "paraxial rule": (({"surface": "torus", **PLACED},), {"numerics": {"snell": "paraxial"}}, 60, {2}),
    "source within": (
        ({"surface": "sphere", "r": 1.2, "stretch": [1.0, 0.9, 0.5]},),
        {"source": {"kind": "point", "at": [0.1, 0.1, 0.2]},
         "film": {"centre": [0.0, 0.0, 0.1], "right": [0.3, 0.0, 0.0], "down": [0.0, -0.3, 0.02]}},
        500, {1},
    ),
    "march": (({"surface": "torus"},), {"numerics": {"method": "march"}}, 90, {2}),
    "lens of no power": (({"surface": "sphere", "r": 0.4, "n": 1.0},), {}, 20, {2}),
} | {
    surface: (({"surface": surface, "rotate": [10, 20, 30], "stretch": [0.8, 0.7, 0.9]},), {}, 20, set())
    for surface in CATALOGUE if surface not in ("torus", "heart", "bifolia")
}  # fmt: skip
ALWAYS = (
    *("torus", "heart", "bifolia", "solid of three faces", "expression", "parallel light, many reflections"),
    *("bubble that reflects", "two lenses", "paraxial rule", "source within"),
)


def scene_of(name: str, size: int = 24, **numerics: Any) -> Scene:
    lenses, more, _, _ = SCENES[name]
    tables = {
        **more,
        "film": {**more.get("film", {}), "size": [size, size]},
        "effects": {"footprint": True, **more.get("effects", {})},
        "numerics": {**more.get("numerics", {}), **numerics},
    }
    return make_scene(*lenses, **tables)


def compared(scene: Scene, believed: float = 1e-7) -> tuple[NDArray[Any], NDArray[Any]]:
    """Return how far the jacobians of rays through a lens are off, as a share of their size, and the rays' events."""
    raymap = trace(scene)
    assert np.isfinite(raymap.jacobian).all()
    rows, columns = (each.ravel().astype(float) for each in np.indices(raymap.status.shape))
    true = slopes(scene, rows, columns)
    told = (true.error < believed) & (raymap.events.ravel() > 0) & (raymap.st.reshape(-1, 2) != -1).any(axis=1)
    apart = np.abs(raymap.jacobian.reshape(-1, 2, 2) - true.jacobian)[told].max(axis=(1, 2))
    return apart / np.abs(true.jacobian[told]).max(axis=(1, 2)), raymap.events.ravel()[told]


@pytest.mark.parametrize("name", thinned(SCENES, ALWAYS))
def test_it_is_the_derivative_of_the_map(name: str) -> None:
    _, _, fewest, paths = SCENES[name]
    off, events = compared(scene_of(name))
    assert len(off) >= fewest
    assert paths <= set(events.tolist())
    assert off.max() < 1e-6


@pytest.mark.parametrize(("precision", "close"), [("single", 1e-4), ("mixed", 1e-6)])
def test_every_precision_has_its_digits(precision: str, close: float) -> None:
    """In single a few rays that graze have lost what their normals have; so quantiles, and the size of the worst."""
    off, _ = compared(scene_of("two lenses", 32, precision=precision))
    assert len(off) > 150
    assert np.quantile(off, 0.98) < close
    assert np.median(off) < close / 50


@pytest.mark.parametrize("precision", ["single", "double"])
@pytest.mark.parametrize("name", thinned(SCENES, ("torus", "parallel light, many reflections")))
def test_it_only_observes(name: str, precision: str) -> None:
    """On the device's own packets, where the last rays of each are put aside and carried on."""
    scene = scene_of(name, 64, precision=precision)
    found, bare = trace(scene), trace(scene.replace({"effects.footprint": False}))
    for array in ("st", "status", "events"):
        np.testing.assert_array_equal(getattr(found, array), getattr(bare, array))
    assert "footprint" in found.kernel.text
    assert "footprint" not in bare.kernel.text.replace("// effects", "")
    assert found.jacobian.dtype == found.st.dtype
    assert found.jacobian.shape == (64, 64, 2, 2)
    nowhere = ~np.isin(found.status, [RayStatus.PICTURE, RayStatus.OFF_PICTURE])
    assert (found.jacobian[nowhere] == 0).all()
    assert (found.jacobian[~nowhere] != 0).any(axis=(1, 2)).all()


@pytest.mark.parametrize(
    ("precision", "width"), thinned(FORMS, [("single", 1), ("single", 32), ("double", 2), ("double", 16)])
)
def test_packets_of_every_width_carry_it(precision: str, width: int) -> None:
    scene = make_scene({"surface": "torus", **PLACED}, effects={"footprint": True}, film={"size": [37, 5]},
                       numerics={"precision": precision})  # fmt: skip
    found, plain = (trace(scene, device=each) for each in (optimised_device(width, width), plain_device()))
    assert (found.events > 0).sum() > 20
    close = {"single": 2e-4, "double": 1e-12}[precision]
    size = np.abs(plain.jacobian).max(axis=(2, 3), keepdims=True) + 1e-30
    off = np.abs(found.jacobian - plain.jacobian) / size
    assert np.quantile(off, 0.99) < close


FOOTPRINT = "effects/footprint.cl"
BROKEN = (
    Fault("curvature left out", "effects/footprint.cl", "inverse * across.x, inverse * across.y, inverse * across.z",
          "(realv)0 * across.x, (realv)0 * across.y, (realv)0 * across.z"),
    Fault("curvature outward always", "effects/footprint.cl", "(realv)1 / dot3(curve.gradient, n)",
          "(realv)1 / sqrt(dot3(curve.gradient, curve.gradient))"),
    Fault("points not moved along the surface", "effects/footprint.cl", "-dot3(normal, moved) /",
          "(realv)0 *"),
    Fault("second derivatives mixed up", "lens_hessian.cl", "h[1] * v.x + h[3] * v.y", "h[3] * v.x + h[1] * v.y"),
    Fault("ways not taken into the lens's space", "lens_hessian.cl", "to_local_vector(lens, way)", "way"),
    Fault("cosine behind for that before", "effects/footprint_exact.cl", "c_change / k", "c_change / c"),
    Fault("direction kept", "effects/footprint_point.cl", "at3(nowhere, across, nearness)", "nowhere"),
)  # fmt: skip


@pytest.mark.parametrize("fault", BROKEN, ids=lambda fault: fault.name)
def test_a_broken_formula_is_seen(fault: Fault) -> None:
    with broken(fault):
        off, _ = compared(scene_of("torus", 16))
    assert len(off) > 20
    assert np.median(off) > 1e-3


def test_reflections_are_seen_to_be_broken_too() -> None:
    name, file = "mirrored without the normal's turn", "effects/footprint.cl"
    fault = Fault(name, file, "n_change, (realv)-2 * dot3(d, n)", "n_change, (realv)0")
    with broken(fault):
        off, events = compared(scene_of("parallel light, many reflections", 16))
    assert off[events == 2].max() < 1e-6
    assert np.median(off[events > 2]) > 1e-3


def test_a_ball_magnifies_as_its_matrices_say() -> None:
    """On the axis, by the paraxial matrices (Born & Wolf, 7th ed., sec. 4.4.2): a pixel's height over the place's."""
    for radius, n, behind in ((0.7, 1.5, 2.5), (0.5, 1.9, 0.9), (0.3, 1.3, 4.0)):
        scene = make_scene(
            {"surface": "ball", "diameter": 2 * radius, "n": n}, effects={"footprint": True}, film={"size": [33, 33]},
            picture={"corner": [-3.0, 3.0, -behind]},
        )  # fmt: skip
        bend = np.array([[1.0, 0.0], [-(n - 1) / radius, 1.0]])  # of height and index times angle, on entry and exit
        leg = lambda length, index: np.array([[1.0, length / index], [0.0, 1.0]])  # noqa: E731 - a name for a formula
        whole = leg(behind - radius, 1.0) @ bend @ leg(2 * radius, n) @ bend @ leg(4.0 - radius, 1.0)
        height = whole[0, 1] * (1.3 / 33) / 1.5  # of the ray through the next pixel
        raymap = trace(scene)
        jacobian = raymap.jacobian[16, 16]
        np.testing.assert_allclose(jacobian, height / 6.0 * np.array([[0.0, 1.0], [1.0, 0.0]]), atol=1e-14, rtol=1e-12)
        assert raymap.fold[16, 16] == 1
        np.testing.assert_allclose(raymap.magnification[16, 16], (height * 33 / 1.3) ** 2, rtol=1e-12)


def test_a_rod_mirrors_the_picture_behind_its_focus_and_a_ball_turns_it_round() -> None:
    for lens, mirrored in (({"surface": "rod", "diameter": 0.6, "length": 3.0, "rotate": [0, 90, 0]}, True),
                           ({"surface": "ball", "diameter": 0.6}, False)):  # fmt: skip
        raymap = trace(make_scene(lens, effects={"footprint": True}, film={"size": [33, 33]}))
        assert raymap.fold.dtype == np.int8
        assert raymap.fold[16, 16] == (-1 if mirrored else 1)
        assert raymap.jacobian[16, 16, 1, 0] < 0
        assert (raymap.jacobian[16, 16, 0, 1] < 0) != mirrored
        straight = (raymap.events == 0) & (raymap.st != -1).any(axis=-1)
        assert straight.sum() > 100
        assert (raymap.fold[straight] == 1).all()
        np.testing.assert_allclose(raymap.magnification[straight], (6.5 / 1.5) ** 2, rtol=1e-12)


def test_rays_given_as_the_films_are_have_the_films_footprints() -> None:
    for source in (None, SLANTED):
        scene = make_scene({"surface": "torus", **PLACED}, effects={"footprint": True}, source=source,
                           film={"size": [16, 16]})  # fmt: skip
        raymap = trace(scene)
        paths = trace_rays(scene, *film_rays(scene, np.arange(256)))
        assert (raymap.events > 0).sum() > 20
        np.testing.assert_allclose(paths.jacobian, raymap.jacobian.reshape(256, 2, 2), rtol=1e-9, atol=1e-12)


def test_rays_that_single_precision_cannot_decide_have_theirs_from_double(monkeypatch: pytest.MonkeyPatch) -> None:
    scene = make_scene({"surface": "bifolia"}, effects={"footprint": True}, film={"size": [96, 96]})
    exact, mended = trace(scene), trace(scene, precision="single")
    monkeypatch.setattr(job.Job, "_more_precise", lambda *_: None)
    left = trace(scene, precision="single").status == RayStatus.UNDECIDED
    assert left.sum() == mended.escalated > 10
    same = left & (mended.events == exact.events) & (exact.status != RayStatus.UNDECIDED)
    assert same.sum() > 10
    np.testing.assert_allclose(mended.jacobian[same], exact.jacobian[same], rtol=1e-6, atol=1e-9)
    assert mended.jacobian.dtype == np.float32


HOSTILE: dict[str, Scene] = {
    "source in the film's plane": make_scene(
        {"surface": "sphere"}, source={"kind": "point", "at": [0.0, 0.0, 2.5]}, effects={"footprint": True},
        film={"centre": [0.0, 0.3, 2.5], "size": [9, 9]},
    ),
    "tip and dimple of the heart": make_scene(
        {"surface": "heart"}, effects={"footprint": True}, film={"size": [9, 9], "right": [1e-6, 0, 0],
                                                                "down": [0, -1e-6, 0]},
    ),
    "edge of a solid": make_scene(
        {"surface": "max(abs(x) + z - 0.5, -z - 0.5)", "bounds": [[-2, -2, -2], [2, 2, 2]]}
        | {"surface": "max(max(abs(x) + z - 0.5, -z - 0.5), abs(y) - 0.7)"},
        effects={"footprint": True}, film={"size": [9, 9]},
    ),
    "source on the surface": make_scene(
        {"surface": "sphere", "r": 1.0}, source={"kind": "point", "at": [0.0, 0.0, 1.0]}, effects={"footprint": True},
        film={"centre": [0.0, 0.0, 0.9], "size": [9, 9]},
    ),
    "film of a thousandth of a thousandth": make_scene(
        {"surface": "torus", "r": 1e-7, "R": 5e-7}, source={"kind": "point", "at": [0.0, 0.0, 4e-6]},
        effects={"footprint": True},
        film={"centre": [0, 0, 2.5e-6], "right": [1e-6, 0, 0], "down": [0, -1e-6, 0], "size": [9, 9]},
        picture={"corner": [-3e-6, 3e-6, -2.5e-6], "right": [6e-6, 0, 0], "down": [0, -6e-6, 0]},
    ),
}  # fmt: skip


@pytest.mark.parametrize("precision", ["single", "double"])
@pytest.mark.parametrize("name", HOSTILE)
def test_it_is_always_a_number(name: str, precision: str) -> None:
    raymap = trace(HOSTILE[name].replace({"numerics.precision": precision}))
    for array in (raymap.jacobian, raymap.magnification, raymap.fold):
        assert np.isfinite(array).all()
    assert set(np.unique(raymap.fold)) <= {-1, 0, 1}
    if "plane" in name:
        assert (raymap.jacobian == 0).all()
    else:
        assert (raymap.jacobian != 0).any()


def test_who_has_not_asked_is_told_how_to() -> None:
    raymap = trace(make_scene({"surface": "sphere"}, film={"size": [4, 4]}))
    for name in ("jacobian", "magnification", "fold"):
        with pytest.raises(AttributeError, match=rf"{name}; trace with effects\.footprint"):
            getattr(raymap, name)


@pytest.mark.parametrize("precision", ["single", "double"])
def test_what_no_place_could_change_by_is_0(precision: str) -> None:
    """Of a ray that only just meets its plane, far off, and of one in the film's plane, whose pencil has no size."""
    scene = make_scene(
        {"surface": "sphere"}, effects={"footprint": True}, numerics={"precision": precision},
        picture={"corner": [-3.0, -1.0, 3.0], "right": [6.0, 0.0, 0.0], "down": [0.0, 0.0, 6.0]},
    )  # fmt: skip

    def jacobian() -> NDArray[Any]:
        starts = [[3.0, 0.0, 4.0], [3.0, 0.0, 4.0], [3.0, 0.0, 2.5]]
        paths = trace_rays(scene, starts, [[0.0, -1e-20, -1.0], [0.0, -0.5, -1.0], [0.1, -1.0, 0.0]],
                           device=plain_device())  # fmt: skip
        assert (paths.status == RayStatus.OFF_PICTURE).all()
        return paths.jacobian

    found = jacobian()
    assert found[0, 1, 0] == 0.0  # of t by the row
    assert 1e15 < found[0, 0, 1] < 1e20  # of s by the column
    assert (found[2] == 0).all()
    assert 1e-3 < found[1, 1, 0] < 1e3
    with broken(Fault("any change of a place", FOOTPRINT, "(lanes & (abs_v(a) <= FARTHEST)) ? a", "lanes ? a")):
        kept = np.abs(jacobian())
    assert kept[0, 1, 0] > 1e30
    assert not np.isfinite(kept[2]).all()
