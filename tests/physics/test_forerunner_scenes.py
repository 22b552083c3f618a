"""The forerunner's scenes: kernels against twin, and both against figures certified in exact arithmetic."""

from __future__ import annotations

import numpy as np
import pytest
from probe import plain_device
from scenes import forerunner

from lenscl import RayStatus, reference, trace

# Certified at 64 x 64, reflection followed: the share of lens rays that meet total reflection, and the most events
CERTIFIED = {"ellipsoid": (0.132, 16), "torus": (0.007, 4), "heart": (0.064, 9), "bifolia": (0.151, 24)}


@pytest.mark.parametrize("name", CERTIFIED)
def test_total_reflection_meets_the_certified_share_of_the_lens_rays(name: str) -> None:
    share, most_events = CERTIFIED[name]
    scene = forerunner(name)
    assert scene.numerics.max_events == 64
    for method in ("auto", "march"):
        followed = trace(scene.replace({"effects.total_reflection": "follow"}), method=method)
        ended = trace(scene.replace({"effects.total_reflection": "end"}), method=method)
        lens_rays = int((followed.events > 0).sum())
        assert lens_rays > 500
        assert ended.counts()[RayStatus.TOTAL_REFLECTION] / lens_rays == pytest.approx(share, abs=0.005)
        assert followed.events.max() == most_events

    # The twin marches, too
    twin = reference.trace(scene.replace({"effects.total_reflection": "follow"}))
    assert twin.counts() == followed.counts()
    np.testing.assert_array_equal(twin.events, followed.events.ravel())
    assert (twin.total > 0).sum() == ended.counts()[RayStatus.TOTAL_REFLECTION]


@pytest.mark.parametrize("name", CERTIFIED)
def test_kernels_and_twin_land_in_the_same_place(name: str) -> None:
    scene = forerunner(name, 48)
    raymap, twin = trace(scene, method="march"), reference.trace(scene)
    np.testing.assert_array_equal(raymap.status.ravel(), twin.status)
    error = np.abs(raymap.st.reshape(-1, 2) - twin.st).max(axis=1)
    met = twin.events > 0
    assert met.sum() > 300
    assert np.median(error[met]) < 1e-13
    assert np.quantile(error[met], 0.99) < 1e-9  # many reflections and silhouettes spread rounding


@pytest.mark.parametrize("name", CERTIFIED)
@pytest.mark.parametrize("widths", [(1, 1), (4, 2), (8, 4)])
def test_packet_width_changes_no_status_and_no_event(name: str, widths: tuple[int, int]) -> None:
    scene = forerunner(name, 33)
    wide, narrow = trace(scene), trace(scene, device=plain_device(*widths))
    np.testing.assert_array_equal(wide.status, narrow.status)
    np.testing.assert_array_equal(wide.events, narrow.events)
    assert np.quantile(np.abs(wide.st - narrow.st), 0.99) < 1e-9


@pytest.mark.parametrize("name", CERTIFIED)
def test_single_agrees_with_double_but_for_a_few_rays(name: str) -> None:
    scene = forerunner(name)
    double, single = trace(scene), trace(scene, precision="single")
    assert single.st.dtype == np.float32
    assert (double.status != single.status).mean() < 0.005
    same = (double.events == single.events) & (double.events > 0)
    assert np.median(np.abs(double.st - single.st)[same]) < 5e-6


@pytest.mark.parametrize("name", CERTIFIED)
def test_nothing_in_a_map_is_nan_and_statuses_sum_to_the_pixels(name: str) -> None:
    for precision in ("single", "double"):
        raymap = trace(forerunner(name, 100), precision=precision)
        for array in (raymap.st, raymap.origin, raymap.direction):
            assert np.isfinite(array).all()
        assert sum(raymap.counts().values()) == 100 * 100
        undefined = ~np.isin(raymap.status, (RayStatus.PICTURE, RayStatus.OFF_PICTURE))
        assert (raymap.st[undefined] == -1).all()
        length = np.linalg.norm(raymap.direction, axis=-1)
        assert np.abs(length - 1).max() < (1e-5 if precision == "single" else 1e-13)
