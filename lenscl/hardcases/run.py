"""Run the pack on a device."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from lenscl.config import Scene, scene_from_toml
from lenscl.device import Device
from lenscl.errors import BuildError, StudyError, TraceError
from lenscl.hardcases.blocked import misplaced
from lenscl.hardcases.case import Answers, Case, Level
from lenscl.hardcases.counted import miscounted
from lenscl.hardcases.judge import Verdict, Wrong, judge
from lenscl.hardcases.pack import Pack
from lenscl.tracing import RayMap, RayPaths, methods_of, trace, trace_rays

_LEVEL: dict[str, Level] = {"single": "single", "mixed": "double", "double": "double"}
# What a direction's length may be off 1: each surface adds some roundings times the ratio of its indices, 1000 at most
_LENGTH: dict[Level, float] = {"single": 1e-2, "double": 1e-9}


def run_pack(
    pack: Pack, *, method: str, precision: str, device: Device, report: Callable[[Case], None] = lambda _: None
) -> Iterator[Verdict]:
    """Trace every case and judge it.

    Parameters
    ----------
    pack : Pack
    method, precision : str
        As in a study's `[numerics]`; mixed is judged as double.
    device : Device
        Where to trace.
    report : callable
        Told of every case before it is run: its kernel may take a minute to be compiled.

    Yields
    ------
    Verdict
        A case each, in the pack's order.
    """
    compared = {case.equals for case in pack.cases if case.equals}
    kept: dict[str, Answers] = {}
    for case in pack.cases:
        report(case)
        if case.refused:
            yield _refusal(case)
            continue
        scene = scene_from_toml(case.scene).replace({"numerics.method": method, "numerics.precision": precision})
        try:
            ends = traced(case, scene, device)
        except StudyError as error:
            yield Verdict(case=case, refusal=error.problems[0])
            continue
        except (BuildError, TraceError) as error:
            yield Verdict(case=case, wrong=(Wrong(ray=None, what=f"is not traced: {error}"),))
            continue
        answers, level = _answers(ends), _LEVEL[precision]
        if case.name in compared:
            kept[case.name] = answers
        finest: Level = "double" if device.has_double else "single"
        verdict = judge(case, pack.expected[case.name], answers, level, finest)
        broken = [*_broken(ends, level), *misplaced(case, scene, ends, level)]
        broken += miscounted(case, scene, pack.expected[case.name], ends, level)
        verdict = replace(verdict, again=ends.escalated, wrong=(*verdict.wrong, *broken))
        yield _with_differences(verdict, answers, kept[case.equals]) if case.equals in kept else verdict


def traced(case: Case, scene: Scene, device: Device) -> RayMap | RayPaths:
    """Trace a case's rays through its scene; errors as `trace` and `trace_rays`."""
    methods_of(scene)
    if case.origins is None or case.directions is None:
        return trace(scene, device=device)
    return trace_rays(scene, case.origins, case.directions, device=device)


def _answers(ends: RayMap | RayPaths) -> Answers:
    st = ends.st.reshape(-1, 2).astype(np.float64)
    return Answers(status=ends.status.ravel(), events=ends.events.ravel(), st=st)


def _broken(ends: RayMap | RayPaths, level: Level) -> Iterator[Wrong]:
    """Yield the rays, however they ended, that carry what is no number, or a direction that is not unit."""
    count = ends.status.size
    arrays = {name: array.reshape(count, -1) for name, array in ends.added.items()}
    if isinstance(ends, RayPaths):
        arrays |= {"origin": ends.origin, "direction": ends.direction}
        length = np.linalg.norm(ends.direction.astype(np.float64), axis=1)
        for ray in np.flatnonzero(np.abs(length - 1.0) > _LENGTH[level]):
            yield Wrong(ray=int(ray), what=f"has a direction of length {length[ray]:.9g}")
    for name, array in arrays.items():
        for ray in np.flatnonzero(~np.isfinite(array).all(axis=1)):
            yield Wrong(ray=int(ray), what=f"{name} is {array[ray]}")


def _refusal(case: Case) -> Verdict:
    try:
        scene_from_toml(case.scene)
    except StudyError as error:
        keys = [problem.partition(":")[0] for problem in error.problems]
        if case.refused in keys:
            return Verdict(case=case)
        what = f"is refused for {', '.join(keys)}, not for {case.refused}"
    else:
        what = "is not refused"
    return Verdict(case=case, wrong=(Wrong(ray=None, what=what),))


def _with_differences(verdict: Verdict, answers: Answers, others: Answers) -> Verdict:
    """Add the rays whose answers are not the other case's, bit for bit."""
    differs = (answers.status != others.status) | (answers.events != others.events)
    differs |= (answers.st != others.st).any(axis=1)
    more = [
        Wrong(ray=int(ray), what=f"is not, bit for bit, as in {verdict.case.equals!r}")
        for ray in np.flatnonzero(differs)
    ]
    return replace(verdict, wrong=(*verdict.wrong, *more))


@dataclass(frozen=True, slots=True, kw_only=True)
class FamilyResult:
    """What a device made of a family of cases: sums, and the largest error, over the cases that the method serves."""

    family: str
    edition: int
    cases: int
    rays: int
    worst: float
    beside: int
    untold: int
    undecided: int
    reasons: Mapping[str, int]  # of those left undecided; they sum to them
    needless: int
    again: int
    wrong: int
    refused: int


def by_family(verdicts: Sequence[Verdict]) -> list[FamilyResult]:
    """Sum up verdicts, families in the order in which they first come."""
    families = list(dict.fromkeys(verdict.case.family for verdict in verdicts))
    return [_summed(family, [each for each in verdicts if each.case.family == family]) for family in families]


def _summed(family: str, verdicts: Sequence[Verdict]) -> FamilyResult:
    served = [each for each in verdicts if not each.refusal]
    return FamilyResult(
        family=family,
        edition=verdicts[0].case.edition,
        cases=len(served),
        rays=sum(each.rays for each in served),
        worst=max((each.worst for each in served), default=0.0),
        beside=sum(each.beside for each in served),
        untold=sum(each.untold for each in served),
        undecided=sum(each.undecided for each in served),
        reasons=dict(sum((Counter(each.reasons) for each in served), Counter()).most_common()),
        needless=sum(each.needless for each in served),
        again=sum(each.again for each in served),
        wrong=sum(len(each.wrong) for each in served),
        refused=len(verdicts) - len(served),
    )
