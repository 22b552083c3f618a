"""Maps of several wavelengths, judged: each wavelength against its own truth, paths and fronts at the d line."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from scenes import make_scene

from lenscl.accuracy import CalibrationCache, Failure, Planner, SelfCheck, check_map, error_map, front
from lenscl.accuracy.achieved import check, wanted_of
from lenscl.accuracy.combination import Combination
from lenscl.accuracy.path import explain_pixel
from lenscl.config import Scene
from lenscl.config.scene import Frozen
from lenscl.device import choose
from lenscl.tracing import RayMap, trace

FILM = {"size": [24, 20]}


def spread(**more: Any) -> Scene:
    return make_scene({"surface": "torus", "n": "SF10"}, film=FILM, effects={"dispersion": 3}, **more)


def mixed_up(raymap: RayMap) -> RayMap:
    """The same map with its first and last wavelength swapped."""
    turned = {name: getattr(raymap, name)[::-1] for name in ("st", "status", "events")}
    return replace(raymap, **turned)


def test_a_layer_is_a_map_of_its_own() -> None:
    raymap = trace(spread())
    layers = raymap.layers()
    assert [layer.scene for layer in layers] == list(raymap.scene.layers())
    assert sum(layer.trace_seconds for layer in layers) == pytest.approx(raymap.trace_seconds)
    for number, layer in enumerate(layers):
        assert layer.added == Frozen()
        np.testing.assert_array_equal(layer.st, raymap.st[number])
        np.testing.assert_array_equal(layer.direction, raymap.direction[number])
        assert layer.layers() == (layer,)


def test_every_wavelength_has_its_own_error_bounds() -> None:
    raymap = trace(spread(numerics={"precision": "single"}))
    error = error_map(raymap)
    assert error.shape == (3, 20, 24)
    for number, layer in enumerate(raymap.layers()):
        np.testing.assert_array_equal(error[number], error_map(layer))
    through = (raymap.events > 0) & (error >= 0)
    assert through.sum() > 200
    assert error[through].max() < 1e-3
    wrong = error_map(mixed_up(raymap))
    assert np.quantile(wrong[0][(raymap.events[2] > 0) & (wrong[0] >= 0)], 0.5) > 1e-3  # held against another index


def test_every_wavelength_is_checked_by_itself() -> None:
    raymap = trace(spread())
    found = check_map(raymap)
    assert not found.failed
    assert found.rays == sum(check_map(layer).rays for layer in raymap.layers()) > 60
    events = raymap.events.copy()
    events[1][events[1] > 0] += 1
    wrong = check_map(replace(raymap, events=events))
    assert wrong.failed > 20
    assert {failure.wavelength for failure in wrong.failures} == {545.0}  # in the middle one alone
    assert all(" at 545 nm: expected" in warning for warning in wrong.warnings())


def test_a_failure_names_its_wavelength_and_is_kept_with_it() -> None:
    failure = Failure(row=7, column=9, event=2, law="snell", residual=1e-3, bound=1e-12)
    found = SelfCheck(rays=1, failed=1, failures=(failure,)).at_wavelength(587.5618)
    assert next(found.warnings()).startswith("pixel (7, 9) at 587.6 nm at surface 2: expected")
    assert SelfCheck.from_json(found.as_json()) == found
    assert " nm" not in str(failure)
    old = found.as_json()
    del old["failures"][0]["wavelength"]  # as it was written down before failures had one
    assert SelfCheck.from_json(old).failures == (failure,)


def test_paths_are_explained_at_the_d_line() -> None:
    scene = spread()
    path, plain = explain_pixel(scene, 10, 6), explain_pixel(scene.at_d_line(), 10, 6)
    assert path.as_json() == plain.as_json()
    assert path.total >= 2


def test_the_front_is_measured_at_the_d_line(monkeypatch: pytest.MonkeyPatch) -> None:
    class SeenError(Exception):
        pass

    def seen(scene: Scene) -> Scene:
        assert scene == spread().at_d_line()
        raise SeenError

    monkeypatch.setattr(front, "coarser", seen)
    with pytest.raises(SeenError):
        front.measure_front(spread(), choose(), title="", made="")


def test_a_wish_is_planned_at_the_d_line_and_checked_at_every_wavelength(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    planned: list[Scene] = []
    single = Combination(method="auto", precision="single")

    class Planning:
        def __init__(self, scene: Scene, *_: Any) -> None:
            planned.append(scene)

        def plan(self) -> Any:
            return SimpleNamespace(combination=single)

    monkeypatch.setattr("lenscl.accuracy.planner.Planning", Planning)
    scene = spread(numerics={"accuracy": "10 px"})
    raymap, achieved = Planner(choose(), CalibrationCache(tmp_path)).trace(scene)
    assert planned == [scene.at_d_line()]
    assert raymap.status.shape == (3, 20, 24)
    assert achieved is not None
    assert achieved.is_met
    errors = [check(layer, wanted_of(scene), single, None).error for layer in raymap.layers()]
    assert len(set(errors)) == 3
    assert achieved.error == max(errors) > 0
