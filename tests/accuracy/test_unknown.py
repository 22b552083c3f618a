"""Rays of which nothing is known: they never count as rays that meet a wish.

The noisy lens is a sphere whose F is a difference of large numbers: in double precision its last digits are lost, the
rays are off by parts of a pixel, and many of them have no error bound.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from scenes import make_scene

import lenscl
from lenscl.accuracy import CalibrationCache, Planner, asked
from lenscl.accuracy.achieved import check, check_paths, unreachable
from lenscl.accuracy.combination import Combination
from lenscl.accuracy.effort import affordable
from lenscl.accuracy.evidence import FilmRays, drawn_of, gathered
from lenscl.accuracy.front import Tried, require_known, require_lens
from lenscl.accuracy.judgement import judge
from lenscl.accuracy.truth import Truth
from lenscl.config import Accuracy, Scene
from lenscl.device import choose
from lenscl.errors import StudyError
from lenscl.reference import oracle
from lenscl.status import RayStatus
from lenscl.tracing import RayMap, trace, trace_rays

NOISY = {"surface": "(x + k)**2 - k**2 - 2*k*x + y**2 + z**2 - 0.25", "bounds": [[-0.6] * 3, [0.6] * 3]}
DOUBLE = Combination(method="polynomial")
ONE_PX = Accuracy(1.0, "px")


def noisy(k: float, wish: str | None = None, **more: Any) -> Scene:
    numerics = {} if wish is None else {"accuracy": wish}
    return make_scene(NOISY | {"k": k}, film={"size": [48, 48]}, numerics=numerics, **more)


@pytest.fixture(scope="module")
def planner(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Planner]:
    """Plans by one search in double alone, whose time is made up; one for all tests, as are their kernels."""

    def best_times(scenes: Sequence[Scene], *_: Any) -> list[float]:
        return [1.0 + number for number, _ in enumerate(scenes)]

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("lenscl.accuracy.planning._PIXELS", (2**12, 2**12))
        patch.setattr("lenscl.accuracy.planning.best_times", best_times)
        patch.setattr("lenscl.accuracy.planning.precisions_of", lambda _: ["double"])
        patch.setattr("lenscl.accuracy.planning.serving", lambda _: ["polynomial"])
        patch.setattr(
            "lenscl.accuracy.planning.Planning._march", lambda self, plan, times, precisions: plan
        )  # no march is timed
        yield Planner(choose(), CalibrationCache(tmp_path_factory.mktemp("calibration")))


def certified_error(raymap: RayMap) -> tuple[float, float]:
    """Return the 99 % error in pixels and the share that ends otherwise, of all that counts, by certified answers."""
    judgement = judge(raymap, Truth.certified(raymap.scene, FilmRays(raymap).near()))
    assert judgement.compared > 100
    return judgement.pixels.high.value, judgement.differ.value


def without_flint(patch: pytest.MonkeyPatch) -> None:
    missing = "certified answers need python-flint, which is not installed: pip install 'lenscl[accuracy]'"
    for name in ("evidence", "achieved"):
        patch.setattr(f"lenscl.accuracy.{name}.flint_trouble", lambda: missing)


# --- judgements -------------------------------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def torus() -> RayMap:
    return trace(make_scene({"surface": "torus"}, film={"size": [40, 30]}, picture={"size": [512, 256]}))


def forgotten(truth: Truth, raymap: RayMap, share: float, *, proved: bool = False) -> tuple[Truth, np.ndarray]:
    """Return a truth that does not know a share of the rays through a lens; which these are."""
    lens = np.flatnonzero(raymap.events)
    some = lens[:: round(1 / share)]
    known, undecidable = truth.is_known.copy(), truth.is_undecidable.copy()
    known[some], undecidable[some] = False, proved
    return replace(truth, is_known=known, is_undecidable=undecidable), some


def test_an_unknown_ray_is_infinitely_far_off_and_ends_otherwise(torus: RayMap) -> None:
    truth = Truth.traced(torus)
    lens = np.count_nonzero(torus.events)
    for share in (0.5, 0.02):
        some_truth, some = forgotten(truth, torus, share)
        judgement = judge(torus, some_truth)
        assert judgement.unknown == len(some) >= 5
        assert judgement.pixels.high.value == judgement.units.high.value == np.inf
        assert judgement.pixels.largest == 0.0  # of those that are known
        assert judgement.differ.value == judgement.unknown_share.value == pytest.approx(len(some) / lens)
    few_truth, few = forgotten(truth, torus, 0.005)
    assert 0 < len(few) < 0.01 * lens
    assert judge(torus, few_truth).pixels.high.value == 0.0  # wherever those few are, 99 % are right


def test_a_ray_that_nobody_can_tell_and_that_says_so_ends_as_it_should(torus: RayMap) -> None:
    truth, some = forgotten(Truth.traced(torus), torus, 0.005, proved=True)
    assert judge(torus, truth).differ.value > 0.0  # decided, though nobody can tell
    status = torus.status.copy()
    status.ravel()[some] = RayStatus.UNDECIDED
    labelled = judge(replace(torus, status=status), truth)
    assert labelled.differ.value == 0.0
    assert labelled.unknown_share.value > 0.0


def test_a_map_without_a_decided_ray_meets_nothing(torus: RayMap) -> None:
    """No ray of it is known to meet a lens, and that is not a film that shows none."""
    status = np.full_like(torus.status, RayStatus.UNDECIDED)
    lost = replace(torus, status=status, events=np.zeros_like(torus.events), st=np.full_like(torus.st, -1.0))
    achieved = check(lost, ONE_PX, DOUBLE, None)
    assert not achieved.is_met
    assert achieved.differ > 0.3
    with pytest.raises(StudyError, match="1200 are undecided"):
        require_lens(lost)


# --- wishes -----------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("k", [1e5, 1e6])
def test_a_noisy_lens_does_not_meet_what_its_rays_miss(planner: Planner, k: float) -> None:
    with pytest.raises(StudyError) as refused:
        planner.trace(noisy(k, "1e-6 px"))
    text = str(refused.value)
    assert text.startswith('numerics.accuracy: "1e-06 px" cannot be reached')
    share = float(text.split(" % of the rays through a lens have no error bound")[0].split()[-1])
    assert 1.0 < share <= 100.0
    assert "without differences of large numbers" in text
    reachable = float(text.split("within ")[1].split(" px")[0])
    error = certified_error(trace(noisy(k)))[0]
    assert 0.01 < error < 10 * reachable < 100 * error  # the plan's film has other rays


def test_a_noisy_lens_meets_a_coarser_wish_by_certified_answers(planner: Planner) -> None:
    raymap, achieved = planner.trace(noisy(1e5, "3 px"))
    assert achieved is not None
    assert achieved.against == "certified answers"
    assert 0.01 < achieved.unbounded <= 1.0  # too many to be proved one by one
    assert achieved.unknown == 0
    error, differ = certified_error(raymap)
    assert 1e-3 < error == pytest.approx(achieved.error)
    assert differ == achieved.differ == 0.0
    with pytest.raises(StudyError, match="cannot be reached"):
        planner.trace(noisy(1e5, f"{0.2 * error * 6 / raymap.scene.picture.size[0]:.3g}"))  # scene units, below that


def test_without_certified_answers_the_share_of_unknown_rays_is_said(
    planner: Planner, monkeypatch: pytest.MonkeyPatch
) -> None:
    without_flint(monkeypatch)
    with pytest.raises(StudyError) as refused:
        planner.trace(noisy(2e5, "0.5 px"))
    text = str(refused.value)
    share = re.match(r"numerics\.accuracy: of ([\d.]+) % of the rays through a lens no error can be told", text)
    assert share is not None
    assert 0.1 < float(share[1]) <= 100.0
    for advice in ("lens.surface", "numerics.method and numerics.precision", "pip install 'lenscl[accuracy]'"):
        assert advice in text
    assert planner.trace(noisy(1.0, "0.5 px"))[1].is_met  # type: ignore[union-attr]


def test_only_the_noisy_points_of_a_sweep_are_refused(planner: Planner) -> None:
    first = noisy(1.0, "1e-4 px")
    met: list[Any] = []
    for k in (1.0, 1e5, 10.0, 1e6):
        try:
            planner.trace(noisy(k, "1e-4 px"), like=first)
        except StudyError as refused:
            met.append("no error bound" in str(refused))
        else:
            met.append("met")
    assert met == ["met", True, "met", True]


def test_one_noisy_lens_of_two_is_enough(planner: Planner) -> None:
    lenses = (
        NOISY | {"k": 1e5, "name": "noisy"},
        {"surface": "sphere", "r": 0.3, "centre": [0, 0, -1], "name": "ball"},
    )
    scene = make_scene(*lenses, film={"size": [32, 32]}, numerics={"accuracy": "1e-6 px"})
    with pytest.raises(StudyError, match="have no error bound"):
        planner.trace(scene)


def test_few_rays_without_a_bound_are_proved_one_by_one(torus: RayMap, monkeypatch: pytest.MonkeyPatch) -> None:
    bounded = Truth.bounded(torus.scene, np.arange(torus.status.size), torus.device)
    holed, some = forgotten(bounded, torus, 0.008)
    asked_for: list[int] = []
    certified = FilmRays.certified

    def counted(self: FilmRays, numbers: Any) -> Truth:
        asked_for.extend(numbers.tolist())
        return certified(self, numbers)

    monkeypatch.setattr(FilmRays, "bounded", lambda self, numbers: holed)
    monkeypatch.setattr(FilmRays, "certified", counted)
    found = gathered(FilmRays(torus), np.arange(torus.status.size), None, 512)
    assert asked_for == some.tolist() != []
    assert found.truth.is_known.all()
    assert found.unbounded == pytest.approx(len(some) / np.count_nonzero(torus.events))
    assert found.of(torus, None).pixels.high.value < 1e-6
    off = torus.st.copy()
    off.reshape(-1, 2)[some] += 0.1
    assert found.of(replace(torus, st=off), None).pixels.largest > 10.0  # their own ends are known again
    asked_for.clear()
    monkeypatch.setattr(FilmRays, "bounded", lambda self, numbers: bounded)
    assert gathered(FilmRays(torus), np.arange(torus.status.size), None, 512).unbounded == 0.0
    assert asked_for == []


def test_what_is_proved_is_a_count_of_rays_and_nested() -> None:
    rays = np.arange(5, 20_000, 3)
    few, drawn = drawn_of(rays, 100)
    more, _ = drawn_of(rays, 1000)
    fewer_rays, _ = drawn_of(rays[rays != few[0]], 100)
    assert drawn is not None
    assert drawn.weights.sum() == pytest.approx(len(rays))
    assert (len(few), len(more)) == (100, 1000)
    assert np.isin(few, more).all()
    assert np.isin(fewer_rays, few).sum() == 99
    assert 0.4 < np.mean(more < np.median(rays)) < 0.6
    assert drawn_of(rays[:50], 100)[1] is None


def test_what_is_not_proved_for_its_cost_stays_unknown_and_is_asked_again(torus: RayMap) -> None:
    pixels = np.flatnonzero(torus.events)[:12]
    scene = torus.scene.replace({"lens.r": 0.31})  # no other test proves rays of it
    cut = Truth.certified(scene, pixels, most_looks=200)
    assert 0 < np.count_nonzero(cut.is_known) < len(pixels)
    assert not cut.is_undecidable.any()
    assert cut.doubt == oracle.TOO_LONG
    whole = Truth.certified(scene, pixels)
    assert whole.is_known.all()
    np.testing.assert_array_equal(cut.st[cut.is_known], whole.st[cut.is_known])
    best = check(torus, ONE_PX, DOUBLE, None)
    vague = replace(best, error=np.inf, unknown=7, unknown_share=0.5, differ=0.5, doubt=cut.doubt)
    assert "of 50 % of the rays through a lens nothing is known" in str(unreachable(vague))


def test_rays_are_counted_by_what_a_ray_costs() -> None:
    plain, dear = (make_scene({"surface": name}) for name in ("torus", "superellipsoid"))
    assert affordable(plain, 0.0, 1000, 8000) == 8000
    assert affordable(dear, 0.0, 1000, 8000) == 1000
    assert 1000 < affordable(plain, 0.2, 1000, 8000) < 8000  # a fifth of its rays are traced again


# --- given rays -------------------------------------------------------------------------------------------------------


def test_given_rays_are_held_to_the_wish_themselves(planner: Planner, monkeypatch: pytest.MonkeyPatch) -> None:
    """The film looks past the noisy lens; the rays do not."""
    monkeypatch.setattr(asked, "planner_of", lambda _: planner)
    aside = {"corner": [40.0, 0.0, 2.5], "right": [0.1, 0.0, 0.0], "down": [0.0, 0.1, 0.0], "size": [8, 8]}
    scene = make_scene(NOISY | {"k": 1e5}, film=aside, numerics={"accuracy": "1e-6 px"})
    x = np.linspace(-0.35, 0.35, 9)
    points = np.stack([x, 0.3 * x, np.full(9, 4.0)], axis=1)
    with pytest.raises(StudyError, match="cannot be reached"):
        lenscl.trace_rays(scene, points, [[0.0, 0.0, -2.0]] * 9)
    paths = lenscl.trace_rays(scene.replace({"lens.k": 1.0}), points, [[0.0, 0.0, -2.0]] * 9)
    assert (paths.events == 2).all()
    beside = lenscl.trace_rays(scene, points + np.array([3.0, 0.0, 0.0]), [[0.0, 0.0, -2.0]] * 9)
    assert (beside.events == 0).all()


def test_given_rays_may_have_what_the_film_cannot(planner: Planner) -> None:
    """A film behind a noisy lens cannot have a wish that rays beside the lens fulfil."""
    scene = noisy(1e5, "1e-6 px")
    points = np.array([[x, 0.1, 4.0] for x in (0.0, 0.1, 2.0, 2.5)])
    with pytest.raises(StudyError, match=r"numerics\.accuracy"):
        planner.trace(scene)
    with pytest.raises(StudyError, match=r"numerics\.accuracy"):
        planner.trace_rays(scene, points, [[0.0, 0.0, -1.0]] * 4)
    paths, achieved = planner.trace_rays(scene, points[2:], [[0.0, 0.0, -1.0]] * 2)
    assert achieved is not None
    assert achieved.is_met
    np.testing.assert_array_equal(paths.events, [0, 0])
    assert (paths.status == RayStatus.PICTURE).all()


def test_given_rays_of_several_wavelengths_are_checked_at_each() -> None:
    scene = make_scene({"surface": "sphere", "n": "SF10"}, effects={"dispersion": 3}, film={"size": [8, 8]})
    points, directions = np.array([[0.1, 0.2, 4.0], [0.0, -0.3, 4.0]]), np.array([[0.0, 0.0, -1.0]] * 2)
    paths = trace_rays(scene, points, directions)
    assert check_paths(paths, points, directions, ONE_PX, DOUBLE).is_met
    st = paths.st.copy()
    st[1] += 0.1
    assert not check_paths(replace(paths, st=st), points, directions, ONE_PX, DOUBLE).is_met


# --- fronts -----------------------------------------------------------------------------------------------------------


def test_a_way_whose_rays_are_unknown_stands_on_no_front(torus: RayMap) -> None:
    truth = Truth.traced(torus)

    def row(some: Truth) -> Tried:
        return Tried(
            combination=DOUBLE, searches=("polynomial",), ns=(1.0,) * 6, first_seconds=1.0,
            judgement=judge(torus, some), differ=0.0, undecided=0.0, escalated=0.0, width=8, kernel_key="k",
        )  # fmt: skip

    assert row(truth).meets(ONE_PX)
    for share in (0.5, 0.005):
        unknown = row(forgotten(truth, torus, share)[0])
        assert not unknown.is_eligible
        assert not unknown.meets(Accuracy(1e9, "px"))
    judgement = row(forgotten(truth, torus, 0.5)[0]).judgement
    with pytest.raises(StudyError, match=r"film: of 50 % of the rays through a lens nobody can tell .*\(grazing\)"):
        require_known(judgement, replace(truth, doubt="grazing"))


# --- clocks -----------------------------------------------------------------------------------------------------------


@pytest.fixture(params=[1e-9, 1.0, 1e9], ids=["quick", "as it is", "late"])
def clock(request: pytest.FixtureRequest, monkeypatch: pytest.MonkeyPatch) -> float:
    """A device whose clock runs otherwise."""
    from lenscl.device import Program

    run: Callable[..., float] = Program.run
    monkeypatch.setattr(Program, "run", lambda *arguments: run(*arguments) * request.param)
    return float(request.param)


SEEN: dict[str, list[Any]] = {"check": [], "plan": []}


def test_a_verdict_is_the_same_on_a_slow_day(clock: float, planner: Planner, monkeypatch: pytest.MonkeyPatch) -> None:
    """Of rays, and of a plan's pixels, there are more than are looked at, and fewer could be."""
    for name in ("achieved._CHECKED", "planning._PIXELS"):
        monkeypatch.setattr(f"lenscl.accuracy.{name}", (2**9, 2**11))
    scene = make_scene({"surface": "torus"}, film={"size": [200, 200]}, numerics={"accuracy": "0.05 px"})
    achieved = check(trace(scene, method="polynomial", precision="double"), ONE_PX, DOUBLE, None)
    SEEN["check"].append(achieved)
    assert achieved.rays > 2**10
    assert achieved == SEEN["check"][0]
    planner._plans.clear()
    planner._planning = None
    plan = planner.plan(scene).achieved
    SEEN["plan"].append(plan)
    assert plan.rays > 2**9
    assert plan == SEEN["plan"][0]


def test_messages_say_what_is_unknown_and_why() -> None:
    scene = noisy(1.0)
    best = check(trace(scene), ONE_PX, DOUBLE, None)
    vague = replace(best, error=np.inf, unknown=7, unknown_share=0.02, differ=0.02, doubt="the ray grazes the surface")
    text = str(unreachable(vague))
    assert "of 2 % of the rays through a lens nobody can tell where they end" in text
    assert "the ray grazes the surface" in text
    lossy = replace(best, differ=0.5, unbounded=0.3)
    assert "50 % of the rays through a lens end otherwise than they should, or may" in str(unreachable(lossy))
    assert "30 % of the rays through a lens have no error bound" in str(unreachable(lossy))
