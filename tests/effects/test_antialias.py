"""More rays a film pixel: which, where, and that their mean is one of light."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from imaging.maps import HandMadeMap, random_pixels
from scenes import make_scene

from lenscl import RayStatus, compile_count, paint, trace
from lenscl.config import Scene
from lenscl.device import Program, choose
from lenscl.imaging import DevicePicture, film_of, paint_film, painter_of, write_map
from lenscl.imaging.encoding import linear_from_srgb, srgb_from_linear
from lenscl.tracing import RayMap, Samples, job, samples
from lenscl.tracing.samples import edges, finer

SIZE = (21, 15)


def torus(asked: Any, precision: str = "double", **more: Any) -> Scene:
    lens = {"surface": "torus", "rotate": [40, 10, 0], **more.pop("lens", {})}
    effects = {"antialias": asked, **more.pop("effects", {})}
    return make_scene(lens, film={"size": SIZE}, effects=effects, numerics={"precision": precision}, **more)


def blocks(fine: Any, side: int) -> Any:
    """Return an image of a fine film with the pixels of each coarse one together: (P, side^2, ...)."""
    rows, columns = fine.shape[0] // side, fine.shape[1] // side
    parts = fine.reshape(rows, side, columns, side, *fine.shape[2:]).swapaxes(1, 2)
    return parts.reshape(rows * columns, side**2, *fine.shape[2:])


@pytest.mark.parametrize(
    ("side", "precision", "more"),
    [
        (2, "single", {"source": {"kind": "parallel", "direction": [0.1, 0, -1]}}),
        (3, "double", {"effects": {"fresnel": True}, "lens": {"absorption": [0.2, 0.5, 1.0]}}),
    ],
)
def test_samples_are_the_rays_of_a_finer_film_and_the_map_stays_as_it_is(
    side: int, precision: str, more: dict[str, Any]
) -> None:
    plain = trace(torus(1, precision, **{key: dict(value) for key, value in more.items()}))
    before = compile_count()
    found = trace(torus(side, precision, **{key: dict(value) for key, value in more.items()}))
    fine = trace(finer(plain.scene, side))
    assert compile_count() == before  # more rays of the same kernel
    assert plain.samples is None
    assert found.samples is not None
    assert (found.samples.side, found.samples.pixels.tolist()) == (side, list(range(SIZE[0] * SIZE[1])))
    assert found.kernel.text == plain.kernel.text
    for name in ("st", "status", "events", *plain.added):
        np.testing.assert_array_equal(getattr(found, name), getattr(plain, name))
        own = found.samples.added[name] if name in plain.added else getattr(found.samples, name)
        np.testing.assert_array_equal(own, blocks(getattr(fine, name), side))
    assert set(found.samples.added) == set(plain.added)
    assert found.escalated == plain.escalated + fine.escalated
    assert (fine.events > 0).sum() > 200


def test_the_time_of_a_map_is_that_of_its_samples_too(monkeypatch: pytest.MonkeyPatch) -> None:
    """Every launch is told to take a second for each of its work-items."""
    run, launched = Program.run, []

    def told(self: Program, name: str, items: int, arguments: Any) -> float:
        run(self, name, items, arguments)
        launched.append(items)
        return float(items)

    monkeypatch.setattr(Program, "run", told)
    plain = trace(torus(1))
    assert plain.trace_seconds == sum(launched) > 0
    launched.clear()
    found = trace(torus(3))
    assert found.trace_seconds == sum(launched) > 5 * plain.trace_seconds


def test_an_undecided_sample_is_traced_again_as_every_ray_is(monkeypatch: pytest.MonkeyPatch) -> None:
    """Samples that the first launch leaves undecided come back as the next precision has them."""
    double = trace(torus(2))
    launch = job.Job.run

    def doubtful(self: Any, ends: Any, tile: Any, first: int, rays: Any) -> None:
        launch(self, ends, tile, first, rays)
        if self.source.structure.precision == "single":
            ends["status"][first : first + tile[3] : 5] = RayStatus.UNDECIDED

    monkeypatch.setattr(job.Job, "run", doubtful)
    for asked in (2, "edges"):
        found = trace(torus(asked, "single"))
        some, rays = found.samples, SIZE[0] * SIZE[1]
        assert some is not None
        assert (some.status != RayStatus.UNDECIDED).all()
        assert found.escalated >= rays // 5 + some.status.size // 5
        if asked == 2:
            np.testing.assert_array_equal(some.status.ravel()[::5], double.samples.status.ravel()[::5])
            close = some.events == double.samples.events
            assert close.mean() > 0.99
            np.testing.assert_allclose(some.st[close], double.samples.st[close], atol=1e-3)


def test_films_in_other_tiles_and_paints_in_other_parts_are_the_same(monkeypatch: pytest.MonkeyPatch) -> None:
    pixels = random_pixels(np.random.default_rng(1), (12, 12, 4), "uint8")
    for asked in (3, "edges"):
        whole = trace(torus(asked))
        painted = paint(whole, pixels)
        with monkeypatch.context() as patch:
            patch.setattr(job, "_TILE_PIXELS", 9 * 50)  # two rows of pixels
            patch.setattr(samples, "_AT_A_TIME", 333)
            parts = trace(torus(asked))
            film = film_of(parts, together=100)
            assert film.layers[0].more is not None
            assert len(list(film.layers[0].more.parts())) > 3
            np.testing.assert_array_equal(parts.samples.st, whole.samples.st)
            np.testing.assert_array_equal(parts.samples.status, whole.samples.status)
            np.testing.assert_array_equal(paint_film(film, DevicePicture.of(film.device, pixels)), painted)
            if asked == 3:
                patch.setattr(job, "_TILE_PIXELS", 9 * 10)  # less than one row
                np.testing.assert_array_equal(trace(torus(asked)).samples.st, whole.samples.st)


def straight_light(pixels: Any) -> Any:
    """Return linear light, multiplied by alpha, of sRGB codes."""
    ratio = pixels / np.iinfo(pixels.dtype).max
    colours = pixels.shape[-1] - (pixels.shape[-1] in (2, 4))
    light = linear_from_srgb(ratio[..., :colours])
    return np.concatenate([light * ratio[..., colours:], ratio[..., colours:]], axis=-1) if colours < 4 else light


@pytest.mark.parametrize(
    ("dtype", "channels", "filter_name"),
    [("uint8", 3, "bilinear"), ("uint16", 4, "nearest"), ("float32", 4, "bicubic"), ("float64", 1, "bilinear")],
)
def test_a_pixel_is_the_mean_light_of_a_finer_film_s(dtype: str, channels: int, filter_name: str) -> None:
    side, more = 3, {"effects": {"fresnel": True}} if dtype in ("uint16", "float64") else {}
    found = trace(torus(side, **more))
    pixels = random_pixels(np.random.default_rng(2), (9, 8, channels), dtype)
    how: dict[str, Any] = {"filter": filter_name, "outside": 1}
    painted = paint(found, pixels, **how)
    fine = paint(trace(finer(found.scene.replace({"effects.antialias": 1}), side)), pixels, **how)
    assert painted.shape == (SIZE[1], SIZE[0], channels)
    if dtype.startswith("float"):
        means = blocks(fine, side).mean(axis=1).reshape(painted.shape)
        np.testing.assert_allclose(painted, means, rtol=1e-5, atol=1e-5)
        plain = paint(replace(found, samples=None), pixels, **how)
        assert (np.abs(painted - plain) > 0.1).mean() > 0.2
        return
    light = blocks(straight_light(fine) if channels == 4 else linear_from_srgb(fine / 255), side).mean(axis=1)
    alpha = light[:, 3:] if channels == 4 else 1.0
    expected = srgb_from_linear(light[:, :3] / np.maximum(alpha, 1e-3)) * np.iinfo(dtype).max
    seen = painted.reshape(-1, channels)
    is_seen = np.broadcast_to(alpha, (len(light), 1))[:, 0] > 0.1
    close = 1.5 if dtype == "uint8" else 1200  # codes; a finer film's alpha and colours are rounded before the mean
    np.testing.assert_allclose(seen[is_seen, :3], expected[is_seen], atol=close)
    assert is_seen.mean() > 0.8
    codes = blocks(fine, side).mean(axis=1)[:, :3]
    assert (np.abs(seen[is_seen, :3] - codes[is_seen]) > 4 * close).sum() > 20  # a mean of codes is another thing


def by_hand(status: Any, share: Any = 1.0) -> HandMadeMap:
    """Return a map of one pixel with samples of such statuses, all at the same place."""
    device = choose()
    sides = np.full((1, len(status), 2), 0.5)
    some = Samples(
        side=int(len(status) ** 0.5), pixels=np.array([0]), st=sides, status=np.array([status], np.uint8),
        events=np.zeros((1, len(status)), np.uint8), added={"transmittance": np.full((1, len(status)), share)},
    )  # fmt: skip
    own = HandMadeMap(sides[:, :1], np.zeros((1, 1), np.uint8), device, {"transmittance": np.ones((1, 1))})
    object.__setattr__(own, "samples", some)
    return own


def test_each_sample_counts_alike_and_what_does_not_land_is_the_colour_outside() -> None:
    off = [RayStatus.OFF_PICTURE, RayStatus.BEHIND, RayStatus.TOTAL_REFLECTION, RayStatus.BLOCKED, RayStatus.UNDECIDED]
    status = [RayStatus.PICTURE] * 4 + off
    white = np.ones((3, 3, 3), np.float32)
    painted = paint(by_hand(status), white, outside=[0.25, 0.5, 4.0])
    np.testing.assert_allclose(painted[0, 0], (4 + 5 * np.array([0.25, 0.5, 4.0])) / 9, rtol=1e-6)
    dimmed = paint(by_hand(status, share=0.5), white, outside=[0.25, 0.5, 4.0])
    np.testing.assert_allclose(dimmed[0, 0], (2 + 5 * np.array([0.25, 0.5, 4.0])) / 9, rtol=1e-6)
    codes = paint(by_hand(status), np.full((3, 3), 255, np.uint8))
    assert codes[0, 0] == round(255 * (1.055 * (4 / 9) ** (1 / 2.4) - 0.055))  # a mean of codes would be 113


@pytest.mark.parametrize("dtype", ["uint8", "uint16", "float16", "float32", "float64"])
def test_a_picture_of_one_colour_stays_that_colour(dtype: str) -> None:
    rng = np.random.default_rng(4)
    for channels in (1, 2, 3, 4):
        colour = random_pixels(rng, (channels,), dtype)
        painted = paint(by_hand([RayStatus.PICTURE] * 9), np.broadcast_to(colour, (5, 6, channels)))
        np.testing.assert_array_equal(painted[0, 0], colour)


def test_what_is_transparent_keeps_the_colour_that_its_own_ray_finds() -> None:
    pixels = np.zeros((1, 1, 4), np.uint8)
    pixels[..., :3] = 10, 20, 30
    assert paint(by_hand([RayStatus.PICTURE] * 4), pixels)[0, 0].tolist() == [10, 20, 30, 0]


@pytest.mark.parametrize("precision", ["single", "double"])
def test_edges_are_refined_and_nothing_else(precision: str) -> None:
    film = {"size": [60, 44]}
    lens = {"surface": "torus", "rotate": [40, 10, 0]}
    how = {"film": film, "numerics": {"precision": precision}}
    scenes = {asked: make_scene(lens, effects={"antialias": asked}, **how) for asked in (1, 4, "edges")}
    found = {asked: trace(scene) for asked, scene in scenes.items()}
    some, every = found["edges"].samples, found[4].samples
    assert some is not None
    assert every is not None
    for name in ("st", "status", "events"):
        np.testing.assert_array_equal(getattr(found["edges"], name), getattr(found[1], name))
    assert 0.02 < some.status.size / every.status.size < 0.3  # the rays it costs

    # Every pixel that differs from one of the eight around it is there, by a plain look at each
    status, events = found[1].status.astype(int), found[1].events.astype(int)
    differs = np.zeros(status.shape, dtype=bool)
    for row, column in np.ndindex(status.shape):
        window = slice(max(row - 1, 0), row + 2), slice(max(column - 1, 0), column + 2)
        differs[row, column] = np.ptp(status[window]) > 0 or np.ptp(events[window]) > 0
    refined = np.zeros(status.shape, dtype=bool)
    refined.ravel()[some.pixels] = True
    assert differs.sum() > 100
    assert (refined | ~differs).all()
    assert (refined & ~differs).sum() < 0.1 * refined.size

    # There it is as n x n everywhere, elsewhere as one ray
    same = (some.status == every.status[some.pixels]) & (some.events == every.events[some.pixels])
    assert same.mean() > (0.98 if precision == "single" else 0.9999)
    apart = np.abs(some.st - every.st[some.pixels]).max(axis=-1)[same]
    assert np.quantile(apart, 0.95) < (1e-4 if precision == "single" else 1e-11)
    pixels = random_pixels(np.random.default_rng(5), (16, 16, 3), "uint8")
    painted = {asked: paint(raymap, pixels) for asked, raymap in found.items()}
    np.testing.assert_array_equal(painted["edges"][~refined], painted[1][~refined])
    off = np.abs(painted["edges"].astype(int) - painted[4])[refined]
    assert (off > 1).mean() < (0.05 if precision == "single" else 0.001)
    assert (painted["edges"][refined] != painted[1][refined]).any(axis=-1).mean() > 0.5


def seen_as(raymap: RayMap, place: Any) -> RayMap:
    """Return a map of the same film with places that a formula gives, all on the picture, of rays that meet nothing."""
    rows, columns = raymap.status.shape
    x, y = np.meshgrid((np.arange(columns) + 0.5) / columns, (np.arange(rows) + 0.5) / rows)
    zero = np.zeros((rows, columns), np.uint8)
    return replace(raymap, st=np.stack(np.broadcast_arrays(*place(x, y)), axis=-1), status=zero, events=zero)


def test_jumps_and_folds_are_edges_and_smooth_steep_places_are_none() -> None:
    raymap = trace(make_scene({"surface": "torus"}, film={"size": [40, 30]}))
    for smooth in (
        lambda x, y: (x, y),
        lambda x, y: (np.sqrt(x), 0.3 * y + 0.2 * x),
        lambda x, y: (x**2, np.sqrt(y)),
        lambda x, y: (0.5 + 0.0 * x, 0.5 + 1e-9 * np.sin(1e5 * x * y)),  # all rays to one place, but for rounding
    ):
        assert not edges(seen_as(raymap, smooth)).any()
    jump = edges(seen_as(raymap, lambda x, y: (0.4 * x + 0.3 * (x > 0.5), y)))
    assert np.flatnonzero(jump.all(axis=0)).tolist() == [19, 20]
    assert jump.sum() == 60
    fold = edges(seen_as(raymap, lambda x, y: ((x - 0.49) ** 2, y)))
    assert np.flatnonzero(fold.any(axis=0)).tolist() in ([18, 19], [19, 20])
    assert fold.any(axis=0).sum() == 2


def test_nothing_to_refine_is_no_sample() -> None:
    away = make_scene(
        {"surface": "torus", "centre": [50.0, 0, 0]}, film={"size": [9, 9]}, effects={"antialias": "edges"}
    )
    found = trace(away)
    assert found.samples is not None
    assert found.samples.st.shape == (0, 16, 2)
    pixels = random_pixels(np.random.default_rng(6), (5, 5, 3), "uint8")
    np.testing.assert_array_equal(paint(found, pixels), paint(replace(found, samples=None), pixels))


def test_no_pixel_to_refine_is_no_work_whatever_else_is_asked() -> None:
    away = make_scene(
        {"surface": "torus", "centre": [50.0, 0, 0]},
        film={"size": [9, 9]},
        effects={"antialias": "edges", "fresnel": "split", "footprint": True},
    )
    found = trace(away)
    assert found.samples is not None
    assert not len(found.samples.pixels)
    pixels = random_pixels(np.random.default_rng(6), (5, 5, 3), "uint8")
    np.testing.assert_array_equal(paint(found, pixels), paint(replace(found, samples=None), pixels))


def test_a_painter_of_samples_serves_many_pictures() -> None:
    found = trace(torus(2))
    painter, rng = painter_of(found), np.random.default_rng(7)
    for channels in (3, 4, 3):
        pixels = random_pixels(rng, (7, 5, channels), "uint8")
        np.testing.assert_array_equal(painter.paint(pixels), paint(found, pixels))


def test_a_film_on_the_source_has_a_sample_without_a_ray() -> None:
    """The source lies in the middle of a pixel: with 3 x 3 samples one of them has no direction."""
    film = {"centre": [0.0, 0.0, 4.0], "right": [15, 0, 0], "down": [0, 0, -15], "size": [5, 5]}
    found = trace(make_scene({"surface": "torus"}, film=film, effects={"antialias": 3}))
    assert found.samples is not None
    assert (found.samples.status[12] == RayStatus.UNDECIDED).sum() == 1
    some = trace(make_scene({"surface": "torus"}, film=film, effects={"antialias": "edges"}))
    assert some.samples is not None  # the pixel around the source differs from all others
    assert 12 in some.samples.pixels


def test_a_file_has_the_samples_under_their_names_and_an_st_map_has_none(tmp_path: Any) -> None:
    found = trace(torus(2, effects={"path_length": True}))
    plain = replace(found, samples=None)
    write_map(tmp_path / "map.npz", found)
    with np.load(tmp_path / "map.npz") as stored:
        assert stored["samples.side"] == 2
        for name in ("pixels", "st", "status", "events"):
            np.testing.assert_array_equal(stored[f"samples.{name}"], getattr(found.samples, name))
        np.testing.assert_array_equal(stored["samples.path_length"], found.samples.added["path_length"])
    write_map(tmp_path / "with.exr", found)
    write_map(tmp_path / "without.exr", plain)
    assert (tmp_path / "with.exr").read_bytes() == (tmp_path / "without.exr").read_bytes()


def test_no_memory_for_samples_is_said_with_the_key(monkeypatch: pytest.MonkeyPatch) -> None:
    from lenscl.errors import TraceError

    plain = trace(torus(1))
    empty = np.empty

    def short(shape: Any, *rest: Any) -> Any:
        if np.prod(shape) > 10_000:
            raise MemoryError
        return empty(shape, *rest)

    monkeypatch.setattr(job.np, "empty", short)
    with pytest.raises(TraceError, match=r"^effects\.antialias: there is no memory for so many rays; ask for fewer"):
        samples.with_samples(replace(plain, scene=torus(16)))
