"""Maps and paths are values: they can be pickled, copied and compared, and then still answer all that they answered."""

from __future__ import annotations

import copy
import pickle
import subprocess
import sys
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scenes import make_scene

import lenscl
from lenscl.config import Scene
from lenscl.device import Device
from lenscl.tracing import RayMap, RayPaths, trace_without

SMALL = {"size": [12, 9]}
BALL: dict[str, Any] = {"surface": "sphere", "r": 0.5}
EFFECTS: dict[str, dict[str, Any]] = {
    "plain": {},
    "wavelengths": {"dispersion": "rgb", "path_length": True},
    "samples": {"antialias": 2, "fresnel": "split"},
    "light": {"caustics": True, "footprint": True},
}


def scene_with(effects: str, **lens: Any) -> Scene:
    return make_scene(BALL | {"n": "BK7"} | lens, film=SMALL, picture={"size": [16, 16]}, effects=EFFECTS[effects])


@pytest.fixture(scope="module", params=EFFECTS)
def raymap(request: pytest.FixtureRequest) -> RayMap:
    return lenscl.trace(scene_with(request.param))


def paths_of(scene: Scene) -> RayPaths:
    return lenscl.trace_rays(scene, [[0.0, 0.0, 4.0], [0.4, 0.0, 4.0]], [[0.0, 0.0, -1.0]] * 2)


def again(value: Any) -> Any:
    return pickle.loads(pickle.dumps(value))


def test_a_map_survives_pickling_with_all_that_it_answers(raymap: RayMap) -> None:
    found = again(raymap)
    assert found == raymap
    assert hash(found) == hash(raymap)
    assert found.counts() == raymap.counts()
    assert found.trace_seconds == raymap.trace_seconds
    assert found.device == raymap.device
    assert found.kernel.text == raymap.kernel.text
    assert set(found.added) == set(raymap.added)
    for name in raymap.added:
        np.testing.assert_array_equal(getattr(found, name), getattr(raymap, name))
    np.testing.assert_array_equal(found.origin, raymap.origin)  # traced anew, from the scene and the device's name
    np.testing.assert_array_equal(found.direction, raymap.direction)
    grey = np.full((4, 4, 1), 99, np.uint8)
    np.testing.assert_array_equal(lenscl.paint(found, grey), lenscl.paint(raymap, grey))


def test_each_layer_of_a_map_is_such_a_value(raymap: RayMap) -> None:
    layers = raymap.layers()
    for layer in layers:
        found = again(layer)
        assert found == layer
        np.testing.assert_array_equal(found.origin, layer.origin)
    assert all(one != other for one in layers for other in layers if one is not other)


def test_a_pickle_of_a_map_holds_its_arrays_and_no_legs_that_nobody_asked_for() -> None:
    raymap = lenscl.trace(make_scene(BALL, film={"size": [300, 300]}))
    arrays = raymap.st.nbytes + raymap.status.nbytes + raymap.events.nbytes
    assert arrays < len(pickle.dumps(raymap)) < 1.2 * arrays


def test_given_rays_survive_pickling() -> None:
    paths = paths_of(scene_with("plain"))
    found = again(paths)
    assert found == paths
    assert (found.events > 0).any()
    np.testing.assert_array_equal(found.origin, paths.origin)
    assert found.device == paths.device
    assert found != replace(paths, origin=paths.origin + 1.0)


def test_a_copy_shares_arrays_and_a_deep_one_has_its_own(raymap: RayMap) -> None:
    shallow, deep = copy.copy(raymap), copy.deepcopy(raymap)
    assert shallow == raymap == deep
    assert shallow.st is raymap.st
    assert deep.st is not raymap.st
    assert deep.device is raymap.device
    assert deep.scene is raymap.scene
    for name in raymap.added:
        assert not np.shares_memory(deep.added[name], raymap.added[name])
    if raymap.samples is not None:
        assert not np.shares_memory(deep.samples.st, raymap.samples.st)
    if raymap.caustic is not None:
        assert not np.shares_memory(deep.caustic.irradiance, raymap.caustic.irradiance)
    deep.status.flat[0] ^= 1
    assert deep != raymap
    assert shallow == raymap


def test_maps_are_equal_if_they_say_the_same_however_long_that_took(raymap: RayMap) -> None:
    assert lenscl.trace(raymap.scene) == raymap
    assert replace(raymap, trace_seconds=raymap.trace_seconds + 1.0) == raymap
    assert raymap != raymap.st
    assert raymap != replace(raymap, escalated=raymap.escalated + 1)
    assert raymap != replace(raymap, scene=raymap.scene.replace({"lens.r": 0.19}))
    assert raymap != replace(raymap, device=replace(raymap.device, driver="another"))
    for name in ("st", "status", "events"):
        changed = getattr(raymap, name).copy()
        changed.flat[-1] += 1
        assert raymap != replace(raymap, **{name: changed}), name
        assert raymap != replace(raymap, **{name: getattr(raymap, name)[..., :1]}), name
    for name, array in raymap.added.items():
        assert raymap != replace(raymap, added={**raymap.added, name: array + 1}), name
    if raymap.samples is not None:
        assert raymap != replace(raymap, samples=replace(raymap.samples, st=raymap.samples.st + 1))
        assert raymap != replace(raymap, samples=None)
    if raymap.caustic is not None:
        assert raymap != replace(raymap, caustic=replace(raymap.caustic, flux=2.0))
    assert raymap == replace(raymap, st=raymap.st.copy())


def test_what_is_not_a_number_is_equal_to_itself_and_precision_counts() -> None:
    raymap = lenscl.trace(scene_with("plain"))
    unknown = replace(raymap, st=np.full_like(raymap.st, np.nan))
    assert unknown == again(unknown)
    zero = np.zeros_like(raymap.st)
    assert replace(raymap, st=zero) == replace(raymap, st=zero.copy())
    assert replace(raymap, st=zero) != replace(raymap, st=zero.astype(np.float32))


def test_a_map_from_elsewhere_is_read_without_a_driver_and_painted_on_a_device_of_here() -> None:
    raymap = lenscl.trace(scene_with("plain"))
    elsewhere = again(replace(raymap, device=replace(raymap.device, platform="Another", name="machine")))
    assert elsewhere != raymap
    assert isinstance(elsewhere.device, Device)
    assert elsewhere.device.handle is not None
    assert lenscl.paint(elsewhere, np.zeros((2, 2, 3), np.uint8)).shape == (9, 12, 3)
    updated = again(replace(raymap, device=replace(raymap.device, driver="of last year")))
    assert updated.device == raymap.device  # of its name


def test_another_process_reads_a_map_and_starts_no_driver_for_its_arrays(tmp_path: Path) -> None:
    raymap = lenscl.trace(scene_with("plain"))
    (tmp_path / "map").write_bytes(pickle.dumps(raymap))
    text = (
        "import pickle, sys; m = pickle.load(open(sys.argv[1], 'rb'));"
        "print(m.counts() == m.counts(), m == m, 'pyopencl' in sys.modules, m.origin.shape)"
    )
    done = subprocess.run([sys.executable, "-c", text, tmp_path / "map"], capture_output=True, text=True, check=True)
    assert done.stdout.split(maxsplit=3) == ["True", "True", "False", "(9, 12, 3)\n"]


def test_a_map_that_cannot_have_legs_says_so_after_pickling_too() -> None:
    scene = make_scene(BALL, film=SMALL, effects={"fresnel": True})
    bare = again(trace_without(scene, "fresnel"))
    with pytest.raises(lenscl.LensclError, match="a map without one of its effects has none"):
        _ = bare.origin
