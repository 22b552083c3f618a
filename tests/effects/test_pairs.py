"""Effects together: any two of their values meet in a kernel, in both precisions, and each adds what it says."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import combinations, product
from pathlib import Path
from typing import Any

import numpy as np
import OpenImageIO
import pytest
from scenes import make_scene

from lenscl import RayStatus, trace
from lenscl.config import Scene
from lenscl.effects import EFFECTS, Value
from lenscl.errors import ImageError
from lenscl.imaging import painter_of, write_map
from lenscl.tracing import RayMap

# What a map carries beside places, statuses and events, by key and value
ADDS: dict[tuple[str, Value], set[str]] = {
    ("absorption", True): {"transmission"},
    ("absorption", "auto"): {"transmission"},
    ("fresnel", True): {"transmittance"},
    ("fresnel", "polarised"): {"transmittance"},
    ("fresnel", "split"): {"transmittance", "reflectance", "reflected_st"},
    ("path_length", True): {"path_length"},
    ("dispersion", "rgb"): {"wavelengths"},
    ("dispersion", 4): {"wavelengths"},
    ("footprint", True): {"jacobian"},
}
STEERS = ("total_reflection", "absorption", "dispersion")  # keys of effects that change where rays go or how they end
LENSES: tuple[dict[str, Any], ...] = (
    {"surface": "ellipsoid", "a": 0.45, "b": 0.6, "c": 0.3, "n": "BK7", "absorption": [0.3, 1.2, 2.5], "name": "glass"},
    {"surface": "sphere", "r": 0.25, "n": 1.0, "centre": [0.2, 0.1, -1.0], "absorbs": True, "name": "stop"},
)
PICTURE = np.random.default_rng(1).integers(0, 256, (20, 30, 3), np.uint8)
Row = dict[str, Value]
NUMBERS: dict[str, tuple[Value, ...]] = {"antialias": (1, 3), "dispersion": (4,)}  # beside the words of a key
VALUES = {key: (*NUMBERS.get(key, ()), *effect.choices) for key, effect in EFFECTS.items()}


def covering() -> list[Row]:
    """Return rows of values, one of each key, such that any two values of two keys stand in a row together."""
    keys = list(EFFECTS)
    left = {((a, one), (b, other)) for a, b in combinations(keys, 2) for one, other in product(VALUES[a], VALUES[b])}
    rows: list[Row] = []
    while left:
        row: Row = dict([*min(left, key=str)])
        for key in keys:
            if key not in row:
                row[key] = max(VALUES[key], key=lambda value: len(_pairs(row | {key: value}) & left))
        row = {key: row[key] for key in keys}
        left -= _pairs(row)
        rows.append(row)
    return rows


def _pairs(row: Row) -> set[tuple[tuple[str, Value], tuple[str, Value]]]:
    return {((a, row[a]), (b, row[b])) for a, b in combinations([key for key in EFFECTS if key in row], 2)}


def scene_of(row: Row, precision: str) -> Scene:
    return make_scene(
        *LENSES, film={"size": [24, 24]}, picture={"size": [32, 32]}, effects=row, numerics={"precision": precision}
    )


def identical(one: RayMap, other: RayMap) -> bool:
    return all(np.array_equal(getattr(one, name), getattr(other, name)) for name in ("st", "status", "events"))


def test_the_rows_hold_every_pair_of_values() -> None:
    met = {pair for row in covering() for pair in _pairs(row)}
    assert len(met) == sum(len(VALUES[a]) * len(VALUES[b]) for a, b in combinations(EFFECTS, 2))
    assert len(covering()) < 2 * max(len(VALUES[a]) * len(VALUES[b]) for a, b in combinations(EFFECTS, 2))


def traced() -> Iterator[Any]:
    """Yield every row in both precisions; every fourth is optimised in single and one between them in double."""
    for number, row in enumerate(covering()):
        for precision, turn in (("single", 0), ("double", 2)):
            marks = [pytest.mark.users_kernels] if number % 4 == turn else []
            yield pytest.param(row, precision, marks=marks, id="-".join(map(str, (*row.values(), precision))))


@pytest.mark.parametrize(("row", "precision"), list(traced()))
def test_effects_run_together_add_what_they_say_and_observers_move_no_ray(
    row: Row, precision: str, tmp_path: Path
) -> None:
    raymap = trace(scene_of(row, precision))
    assert raymap.added.keys() == set().union(*(ADDS.get(item, set()) for item in row.items()))
    layers = len(raymap.wavelengths) if row["dispersion"] is not False else 0
    assert raymap.status.shape == ((layers, 24, 24) if layers else (24, 24))
    for name in raymap.added.keys() - {"wavelengths"}:
        array = raymap.added[name]
        assert array.shape[: raymap.status.ndim] == raymap.status.shape
        assert array.dtype == raymap.st.dtype
        assert np.isfinite(array).all()
    plain = trace(scene_of({key: row[key] for key in STEERS}, precision))
    assert identical(raymap, plain)
    counts = raymap.counts()
    assert (counts[RayStatus.BLOCKED] > 0) == (row["absorption"] is not False)
    assert (counts[RayStatus.TOTAL_REFLECTION] > 0) == (row["total_reflection"] == "end")
    assert counts[RayStatus.PICTURE] > 200
    assert (raymap.samples is not None) == (row["antialias"] != 1)
    assert (raymap.caustic is not None) == bool(row["caustics"])
    if raymap.caustic is not None:
        assert raymap.irradiance.shape == ((layers, 32, 32) if layers else (32, 32))
        assert sum(raymap.caustic.shares.values()) == pytest.approx(1.0, abs=1e-6)
    painted = painter_of(raymap).paint(PICTURE)
    assert painted.shape == ((32, 32, 3) if row["caustics"] else (24, 24, 3))
    assert painted.std() > 1
    check_files(raymap, tmp_path)


def check_files(raymap: RayMap, folder: Path) -> None:
    """Whatever effects add stands in a map's files; several wavelengths have no place in one, which is said."""
    error = np.full(raymap.status.shape, 1e-9)
    write_map(folder / "map.npz", raymap, error)
    with np.load(folder / "map.npz") as stored:
        for name, array in raymap.added.items():
            np.testing.assert_array_equal(stored[name], array)
    if "wavelengths" in raymap.added:
        with pytest.raises(ImageError, match="holds one wavelength"):
            write_map(folder / "map.exr", raymap, error)
        assert not (folder / "map.exr").exists()
        return
    write_map(folder / "map.exr", raymap, error)
    image = OpenImageIO.ImageBuf(str(folder / "map.exr"))
    channels = dict(zip(image.spec().channelnames, np.moveaxis(image.get_pixels(OpenImageIO.FLOAT), 2, 0), strict=True))
    for name, array in raymap.added.items():
        parts = [channels[channel] for channel in channels if channel == name or channel.startswith(f"{name}.")]
        wanted = np.moveaxis(array.reshape(*raymap.status.shape, -1), 2, 0).astype(np.float32)
        assert sorted(part.tobytes() for part in parts) == sorted(part.tobytes() for part in wanted)


@pytest.mark.parametrize("environment", ["picture", "around.png", [0.2, 0.5, 1.0]], ids=str)
@pytest.mark.parametrize("with_footprint", [False, True])
def test_a_map_of_reflections_is_written_whatever_is_reflected(
    environment: Any, with_footprint: bool, tmp_path: Path
) -> None:
    row = {"fresnel": "split", "environment": environment, "footprint": with_footprint}
    raymap = trace(scene_of(row, "double"))
    shown = {"picture": {"reflected_st"}, "around.png": {"reflected"}}.get(str(environment), set())
    assert raymap.added.keys() - {"jacobian", "transmission"} == {"transmittance", "reflectance"} | shown
    check_files(raymap, tmp_path)
