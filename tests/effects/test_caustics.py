"""Light on the picture: closed forms of its irradiance, and where all of it goes."""

from __future__ import annotations

import itertools
import math
import tracemalloc
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from scenes import make_scene

from lenscl import RayStatus, StudyError, trace
from lenscl.config import Scene
from lenscl.errors import TraceError
from lenscl.imaging import Picture, light, painter_of, write_map
from lenscl.imaging.spectrum import spectral_matrices
from lenscl.sweep import paint_as_told
from lenscl.tracing import RayMap, caustics, memory
from lenscl.tracing import trace as traced
from lenscl.tracing.flux import flux_of_cells, flux_through
from lenscl.tracing.samples import finer

AWAY = {"surface": "sphere", "centre": [50.0, 0.0, 0.0]}
PARALLEL = {"kind": "parallel", "direction": [0.0, 0.0, -1.0]}
SLANTED = {"kind": "parallel", "direction": [0.3, -0.2, -1.0]}


def lit(*lenses: dict[str, Any], columns: int = 40, cells: int = 60, **more: Any) -> RayMap:
    effects = {"caustics": True, **more.pop("effects", {})}
    picture = {"size": [cells, cells], **more.pop("picture", {})}
    film = {"size": [columns, columns], **more.pop("film", {})}
    return trace(make_scene(*lenses, film=film, picture=picture, effects=effects, **more))


def reached(scene: Scene) -> tuple[NDArray[np.bool_], NDArray[np.bool_]]:
    """Return the cells that the cone reaches as a whole, were there no lenses, and those of which it reaches a part."""
    film, picture = scene.film, scene.picture
    s, t = np.meshgrid(np.arange(picture.columns + 1) / picture.columns, np.arange(picture.rows + 1) / picture.rows)
    points = np.asarray(picture.corner) + s[..., None] * picture.right + t[..., None] * picture.down
    if scene.source.at is None:
        back = np.broadcast_to(scene.source.direction, points.shape)
    else:
        back = points - scene.source.at
    normal = np.cross(film.right, film.down)
    on_film = points - (((points - film.corner) @ normal) / (back @ normal))[..., None] * back
    spans = np.stack([film.right, film.down], axis=1)
    places = np.linalg.lstsq(spans, (on_film - film.corner).reshape(-1, 3).T, rcond=None)[0].T.reshape(*s.shape, 2)
    inside = ((places > 1e-9) & (places < 1 - 1e-9)).all(axis=-1)
    corners = [inside[:-1, :-1], inside[:-1, 1:], inside[1:, :-1], inside[1:, 1:]]
    return np.logical_and.reduce(corners), np.logical_or.reduce(corners)


@pytest.mark.parametrize(
    ("source", "picture", "close"),
    [
        (None, {}, 1e-3),
        (None, {"corner": [-3.0, 3.0, -2.0], "down": [0.5, -6.0, -1.0]}, 1e-3),
        (PARALLEL, {"corner": [-1.0, 1.0, -2.5], "right": [2, 0, 0], "down": [0, -2, 0]}, 1e-9),
        (SLANTED, {"right": [6, 0, 1]}, 1e-9),
    ],
)
def test_without_a_lens_it_is_1_where_the_cone_reaches_and_0_elsewhere(source: Any, picture: Any, close: float) -> None:
    found = lit(AWAY, source=source, picture=picture)
    whole, some = reached(found.scene)
    assert whole.sum() > 100
    assert (~some).sum() > 100
    np.testing.assert_allclose(found.irradiance[whole], 1.0, atol=close)
    assert (found.irradiance[~some] == 0.0).all()
    assert ((found.irradiance[some] >= 0.0) & (found.irradiance[some] <= 1.0 + close)).all()
    assert found.caustic is not None
    assert found.caustic.cut == 0


def test_light_that_is_not_weighed_by_its_solid_angle_is_seen(monkeypatch: pytest.MonkeyPatch) -> None:
    """The flux through each film pixel alike, of whatever size its tubes are."""

    def even(scene: Scene, screen: Any) -> Any:
        flux = flux_of_cells(scene, screen)
        return flux if screen is scene.picture else np.full_like(flux, flux.mean())

    def through(scene: Scene, corners: Any, right: Any, down: Any) -> Any:
        part = math.dist(right, (0, 0, 0)) / scene.film.right[0] * scene.film.columns
        return np.full((*corners.shape[:-1], 2), flux_of_cells(scene, scene.film).mean() * part**2)

    monkeypatch.setattr(caustics, "flux_of_cells", even)
    monkeypatch.setattr(caustics, "flux_through", through)
    monkeypatch.setattr(
        caustics, "flux_at", lambda scene, at: np.full(at.shape[:-1], 2 * flux_of_cells(scene, scene.film).mean())
    )
    found = lit(AWAY)
    whole, _ = reached(found.scene)
    assert np.abs(found.irradiance[whole] - 1.0).max() > 0.1


@pytest.mark.parametrize("source", [None, SLANTED])
def test_a_lens_of_the_index_around_it_leaves_the_light_as_it_is(source: Any) -> None:
    found = lit({"surface": "torus", "n": 1.0, "rotate": [30, 20, 0]}, source=source)
    bare = lit(AWAY, source=source)
    assert found.caustic is not None
    assert found.caustic.cut > 60  # its outlines tear tubes
    np.testing.assert_allclose(found.irradiance, bare.irradiance, atol=0.03)
    assert np.abs(found.irradiance - bare.irradiance).mean() < 1e-3
    assert found.irradiance.sum() == pytest.approx(bare.irradiance.sum(), rel=1e-4)


def ball_in_parallel_light(n: float, plane: float, centres: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the irradiance at distances from the axis behind a unit ball, at a distance from its middle.

    A ray at height h meets the ball at asin h, leaves it turned by twice the difference to asin(h / n), from a point
    that has turned likewise; so where it lands is known, and h dh / (r dr) is what it is gathered by.
    """
    h = np.linspace(0.0, 1.0, 400_001)[:-1]
    i, r = np.arcsin(h), np.arcsin(h / n)
    turned = 2 * (i - r)
    x, z = np.sin(2 * r - i), np.cos(2 * r - i)  # where it leaves: z along the light
    place = np.abs(x - np.tan(turned) * (plane - z))  # across the axis
    ring = np.histogram(place[:-1], centres, weights=np.diff(h**2))[0]
    return ring / np.diff(centres**2)


def test_a_ball_gathers_parallel_light_as_its_closed_form_says() -> None:
    n, plane, cells, side = 1.5, 1.2, 200, 1.6
    found = lit(
        {"surface": "sphere", "n": n}, source=PARALLEL, columns=220, cells=cells,
        film={"centre": [0.0, 0.0, 2.5], "right": [2.2, 0, 0], "down": [0, -2.2, 0]},
        picture={"corner": [-side / 2, side / 2, -plane], "right": [side, 0, 0], "down": [0, -side, 0]},
    )  # fmt: skip
    x = ((np.arange(cells) + 0.5) / cells - 0.5) * side
    radius = np.hypot(*np.meshgrid(x, x)).ravel()
    rings = np.linspace(0.1, 0.7, 13)
    expected = ball_in_parallel_light(n, plane, rings)
    number = np.digitize(radius, rings) - 1
    mean = np.array([found.irradiance.ravel()[number == k].mean() for k in range(len(expected))])
    assert expected.max() / expected.min() > 20
    np.testing.assert_allclose(mean, expected, rtol=0.06, atol=0.01)  # cells at a ring's edges lie on both sides
    assert np.median(np.abs(mean / expected - 1.0)) < 0.02


def test_a_thin_lens_gathers_by_the_law_of_areas_near_its_axis() -> None:
    """On the axis the beam shrinks by 1 - d / f each way: 1 / (1 - d / f)^2; f by both surfaces' matrices."""
    n, radius, plane = 1.5, 1.0, 1.3
    found = lit(
        {"surface": "sphere", "n": n, "r": radius}, source=PARALLEL, columns=40, cells=40,
        film={"centre": [0.0, 0.0, 2.5], "right": [0.08, 0, 0], "down": [0, -0.08, 0]},
        picture={"corner": [-0.02, 0.02, -plane], "right": [0.04, 0, 0], "down": [0, -0.04, 0]},
    )  # fmt: skip
    power = (n - 1) / radius
    bends = np.array([[1.0, 0.0], [-power, 1.0]])
    into = np.array([[1.0, 0.0], [-power / n, 1.0 / n]])
    out = np.array([[1.0, 0.0], [-power, n]])
    assert bends[1, 0] == out[1, 0]
    height = np.array([[1.0, plane - radius], [0.0, 1.0]]) @ out @ np.array([[1.0, 2 * radius], [0.0, 1.0]]) @ into
    gathered = height[0, 0] ** -2
    assert gathered > 10
    middle = found.irradiance[18:22, 18:22]
    np.testing.assert_allclose(middle, gathered, rtol=2e-3)


SHARING: dict[str, tuple[tuple[dict[str, Any], ...], dict[str, Any]]] = {
    "all at once": (
        (
            {"surface": "torus", "name": "ring", "absorption": [0.3, 0.6, 1.0], "rotate": [40, 0, 20]},
            {"surface": "sphere", "name": "stop", "r": 0.2, "absorbs": True, "centre": [0.0, 0.0, 1.4]},
        ),
        {"effects": {"fresnel": True, "total_reflection": "end"}},
    ),
    "followed": (({"surface": "torus", "rotate": [70, 0, 20]},), {"numerics": {"max_events": 3}}),
    "single": (
        ({"surface": "torus", "rotate": [70, 0, 20]},),
        {"numerics": {"precision": "single"}, "source": SLANTED},
    ),
}


@pytest.mark.parametrize("name", SHARING)
def test_all_light_goes_somewhere_and_there_by_the_count_of_single_rays(name: str) -> None:
    lenses, more = SHARING[name]
    found = lit(*lenses, picture={"corner": [-1.0, 1.0, -2.5], "right": [2, 0, 0], "down": [0, -2, 0]}, **more)
    assert found.caustic is not None
    shares = found.caustic.shares
    assert sum(shares.values()) == pytest.approx(1.0, abs=1e-9)
    assert min(shares.values()) > -1e-12

    # Rays of a film six times as fine, each with the flux of its own pixel
    fine = trace(finer(found.scene.replace({"effects.caustics": False}), 6))
    flux = flux_of_cells(fine.scene, fine.scene.film).sum(axis=-1)
    flux /= flux.sum()
    left = fine.added.get("transmittance", np.ones(flux.shape)).astype(float)
    reflected = (flux * (1 - left)).sum()
    passes = fine.added["transmission"] @ [0.2126, 0.7152, 0.0722] if "transmission" in fine.added else 1.0
    counted = {
        status.name.lower(): float((flux * left * passes)[fine.status == status].sum()) for status in RayStatus
    } | {"reflected": reflected, "absorbed": (flux * left * (1 - passes)).sum()}
    assert set(counted) == set(shares)
    for end, share in shares.items():
        assert share == pytest.approx(counted[end], abs=2e-3), end
    assert sum(share > 1e-3 for share in counted.values()) >= (6 if name == "all at once" else 3)
    direct = flux_of_cells(found.scene, found.scene.picture).sum(axis=-1)
    landed = (found.irradiance * direct).sum() / found.caustic.flux
    assert landed == pytest.approx(shares["picture"], abs=1e-12)


def test_the_flux_through_a_film_is_its_solid_angle() -> None:
    """Of a rectangle seen from its axis: 4 asin(a b / sqrt((a^2 + d^2)(b^2 + d^2))), a and b half its sides."""
    found = lit(AWAY, film={"right": [1.3, 0, 0], "down": [0, -0.7, 0]}, columns=12)
    a, b, d = 0.65, 0.35, 1.5
    expected = 4 * math.asin(a * b / math.sqrt((a * a + d * d) * (b * b + d * d)))
    assert found.caustic is not None
    assert found.caustic.flux == pytest.approx(expected, rel=1e-12)
    tiny = flux_through(found.scene, np.array([0.0, 0.0, 2.5]), np.array([1e-9, 0, 0]), np.array([0, 1e-9, 0]))
    np.testing.assert_allclose(tiny, 0.5e-18 / d**2, rtol=1e-9)
    across = lit(AWAY, source=SLANTED, columns=12)
    assert across.caustic is not None
    assert across.caustic.flux == pytest.approx(1.3**2 / math.sqrt(0.3**2 + 0.2**2 + 1), rel=1e-12)


def test_the_map_stays_as_it_is_and_says_where_the_light_is_to_be_had() -> None:
    lens = {"surface": "torus"}
    found, plain = lit(lens, effects={"antialias": "edges"}), trace(make_scene(lens, film={"size": [40, 40]}))
    for name in ("st", "status", "events"):
        np.testing.assert_array_equal(getattr(found, name), getattr(plain, name))
    assert found.kernel.text == plain.kernel.text
    assert found.samples is not None
    assert plain.caustic is None
    with pytest.raises(AttributeError, match=r"RayMap has no irradiance; trace with effects\.caustics for it"):
        _ = plain.irradiance


def test_a_picture_is_lit_by_it_in_linear_light() -> None:
    found = lit({"surface": "torus"}, picture={"size": [50, 30]})
    grey = np.full((4, 4, 3), [0.1, 0.2, 0.4], np.float32)
    np.testing.assert_allclose(light(found, grey), found.irradiance[..., None] * grey[0, 0], rtol=1e-6)
    ramp = np.linspace(0, 1, 50, dtype=np.float32)[None, :, None].repeat(30, axis=0)
    np.testing.assert_allclose(
        light(found, ramp), found.irradiance[..., None] * ramp, atol=1e-5 * found.irradiance.max()
    )
    codes = light(found, np.full((3, 3), 100, np.uint8))
    assert codes.shape == (30, 50)
    assert (codes[found.irradiance > 20] == 255).all()
    with pytest.raises(StudyError, match=r"effects\.caustics: the map has no light"):
        light(trace(make_scene(AWAY)), grey)


@pytest.mark.parametrize("effects", [{}, {"dispersion": "rgb", "fresnel": True}])
def test_with_footprint_cells_have_the_mean_of_the_picture_that_they_cover(effects: dict[str, Any]) -> None:
    """Stripes finer than cells, one in three of them white: at cells' middles all is white or all is black."""
    parallel = {"film": {"right": [7, 0, 0], "down": [0, -7, 0]}, "picture": {"size": [14, 10]}, "source": PARALLEL}
    lens = {**AWAY, "n": "BK7"}
    found, plain = (lit(lens, **parallel, effects={"footprint": asked, **effects}) for asked in (True, False))
    np.testing.assert_allclose(found.irradiance, 1.0, atol=1e-6)
    rows, columns = np.indices((10 * 9, 14 * 9))
    for stripes in (rows, columns, rows + columns):
        for first in range(3):
            picture = np.repeat((stripes % 3 == first)[..., None], 3, axis=-1).astype(np.float32)
            np.testing.assert_allclose(light(found, picture), 1 / 3, atol=0.06)
            assert np.abs(light(plain, picture) - 1 / 3).max() > 0.3


def test_a_file_has_the_light_and_where_it_goes(tmp_path: Any) -> None:
    found = lit({"surface": "torus"}, picture={"size": [50, 30]})
    write_map(tmp_path / "map.npz", found)
    with np.load(tmp_path / "map.npz") as stored:
        np.testing.assert_array_equal(stored["irradiance"], found.irradiance)
        assert stored["irradiance"].shape == (30, 50)
        assert dict(zip(stored["caustic.ends"].tolist(), stored["caustic.shares"].tolist(), strict=True)) == dict(
            found.caustic.shares
        )


@pytest.mark.parametrize("size", [[1, 1], [1, 4], [3, 1], [2, 2]])
def test_films_of_a_few_pixels_light_the_picture_too(size: list[int]) -> None:
    found = lit({"surface": "torus"}, film={"size": size}, effects={"antialias": "edges"}, cells=9)
    assert found.caustic is not None
    assert sum(found.caustic.shares.values()) == pytest.approx(1.0, abs=1e-9)
    fine = lit({"surface": "torus"}, columns=36, cells=9)
    assert found.caustic.flux == pytest.approx(fine.caustic.flux, rel=1e-9)  # type: ignore[union-attr]


def test_light_that_does_not_fit_into_memory_is_refused_before_it_is_made(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(memory, "free_memory", lambda: 2**30)
    with pytest.raises(
        TraceError, match=r"^effects\.caustics: the cells of a picture of 9,000 x 9,000 .* take 5\.4 GiB"
    ):
        lit(AWAY, picture={"size": [9000, 9000]})


@pytest.mark.parametrize("more", [{}, {"absorption": [1.0, 0.5, 0.2]}])
def test_what_it_takes_is_held_against_what_is_free(more: dict[str, Any], monkeypatch: pytest.MonkeyPatch) -> None:
    """The most that is in memory at a time, but for what hangs on the film, is within what is asked for."""
    held: list[int] = []
    monkeypatch.setattr(caustics, "hold", lambda nbytes, *_: held.append(nbytes))
    effects = {"caustics": True}
    scene = make_scene(
        {"surface": "sphere", "r": 0.5, **more},
        picture={"size": [1500, 1500]},
        film={"size": [20, 20]},
        effects=effects,
    )
    raymap = traced(scene)
    tracemalloc.start()
    caustics.with_caustic(raymap)
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert 0.5 * held[0] < peak < held[0]


@pytest.mark.parametrize(
    ("more", "says"),
    [
        ({"picture": {"corner": [-3.0, 0.0, 4.0], "down": [0, 0, -4]}, "source": {"kind": "point", "at": [0, 0, 3]}},
         "the picture's plane runs through"),
        ({"film": {"down": [0, 0, 1]}, "source": PARALLEL}, "the film's plane runs through"),
    ],
)  # fmt: skip
def test_screens_that_get_no_light_are_refused(more: dict[str, Any], says: str) -> None:
    with pytest.raises(StudyError, match=rf"^effects\.caustics: {says}"):
        lit(AWAY, **more)


@pytest.mark.parametrize("effects", [{"dispersion": 4}, {"dispersion": "rgb", "fresnel": True}])
def test_each_wavelength_lights_the_picture_as_if_it_were_alone(effects: dict[str, Any]) -> None:
    found = lit({"surface": "sphere", "r": 0.5, "n": "SF11"}, columns=16, cells=20, effects=effects)
    alone = [trace(scene).irradiance for scene in found.scene.layers()]
    np.testing.assert_array_equal(found.irradiance, np.stack(alone))
    apart = [np.abs(one - other).max() for one, other in itertools.pairwise(alone)]
    assert min(apart) > 1e-3
    white = light(found, np.ones((4, 4, 3), np.float32))
    shares = spectral_matrices(found.wavelengths).sum(axis=2)
    np.testing.assert_allclose(white, np.einsum("kc,kij->ijc", shares, found.irradiance), atol=2e-5)


@pytest.mark.parametrize(
    ("lens", "columns"),
    [({"surface": "sphere", "r": 0.3}, 1), ({"surface": "sphere", "r": 0.3}, 3), ({"surface": "heart"}, 2),
     ({"surface": "sphere", "r": 0.06, "absorbs": True}, 16)],
)  # fmt: skip
def test_a_lens_of_few_film_pixels_is_not_passed_by(lens: dict[str, Any], columns: int) -> None:
    def shares(film: int) -> NDArray[np.float64]:
        found = lit(lens, columns=film, cells=16, effects={"fresnel": True})
        assert found.caustic is not None
        assert found.caustic.cut > 0
        return np.array([found.caustic.shares["reflected"], found.caustic.shares["blocked"]])

    coarse, fine = shares(columns), shares(96)
    assert fine.max() > 1e-3
    np.testing.assert_allclose(coarse, fine, rtol=0.25, atol=2e-4)


def test_light_beyond_white_is_kept_where_it_is_written_as_light() -> None:
    """A picture of whole numbers becomes light before it is painted, not after."""
    near = {"corner": [-1.0, 1.0, -0.9], "right": [2, 0, 0], "down": [0, -2, 0]}
    found = lit({"surface": "sphere", "r": 0.5}, columns=60, cells=60, picture=near)
    brightest = float(found.irradiance.max())
    assert brightest > 3.0
    white = Picture(np.full((8, 8, 3), 255, np.uint8), "srgb")
    painted, encoding = paint_as_told(painter_of(found), white, found.scene, "exr")
    assert encoding == "linear"
    assert painted.max() == pytest.approx(brightest, rel=1e-2)
    codes, _ = paint_as_told(painter_of(found), white, found.scene, "png")
    assert codes.max() == 255
