"""Judge answers by the condition of each ray: what no move of the problem's numbers explains is wrong."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from lenscl.hardcases import reasons
from lenscl.hardcases.case import ROUNDING, ULPS, Answers, Array, Case, Expected, Level, Moved
from lenscl.status import RayStatus

_LANDS = tuple(int(status) for status in RayStatus if status.lands)
_ALIKE = 4.0  # times more where a ray's path hangs on rounding: only some of its moves end alike, and tell how far
_FEW = 4  # places of moves that end alike; fewer do not tell how far others may lie
# Where moves show so many different paths, or not the exact one, there are others that they do not show; and so where
# a path meets more surfaces than some that they show, and fewer than others
_PATHS = 2
_MORE_EVENTS = 30  # than any move shows: a ray may be reflected as long as it is followed, and no longer
_LEAVES = (*_LANDS, int(RayStatus.BEHIND))  # one way to end: which of them hangs on the last leg, and changes smoothly


@dataclass(frozen=True, slots=True, kw_only=True)
class Wrong:
    """A wrong answer: which ray of the case, and what is wrong, for people; no ray where the case as a whole is."""

    ray: int | None
    what: str

    def __str__(self) -> str:
        return self.what if self.ray is None else f"ray {self.ray}: {self.what}"


@dataclass(frozen=True, slots=True, kw_only=True)
class Verdict:
    """What a device made of a case.

    Attributes
    ----------
    case : Case
    rays : int
    worst : float
        The largest error of a place, in roundings of the precision as the ray's condition magnifies them; `ULPS` are
        allowed. 0 where no ray lands.
    beside : int
        Rays whose path hangs on rounding, and that took one beside the exact one, which a move leads to.
    untold : int
        Rays whose path hangs on rounding, and whose answer the moves are too few to judge.
    undecided : int
        Rays that were left undecided, and that no double precision could decide.
    reasons : mapping of str to int
        Why those could not be decided, and how many for each reason; they sum to `undecided`.
    needless : int
        Rays that were left undecided though double precision could decide them; each is wrong, too.
    again : int
        Rays that were left undecided at first, and traced again in a higher precision.
    wrong : tuple of Wrong
    refusal : str
        Why the method does not serve the scene; empty where it does.
    """

    case: Case
    rays: int = 0
    worst: float = 0.0
    beside: int = 0
    untold: int = 0
    undecided: int = 0
    reasons: Mapping[str, int] = field(default_factory=dict)
    needless: int = 0
    again: int = 0
    wrong: tuple[Wrong, ...] = ()
    refusal: str = ""


def judge(case: Case, expected: Expected, answers: Answers, level: Level, finest: Level = "double") -> Verdict:
    """Hold answers against what is true.

    Parameters
    ----------
    case : Case
    expected : Expected
        Of its rays.
    answers : Answers
        Of the same rays.
    level : "double" or "single"
        The precision that rays are carried in.
    finest : "double" or "single"
        The finest in which rays are traced again that were left undecided.
    """
    exact, moved = expected.answers, expected.moved[level]
    is_same = (answers.status == exact.status) & (answers.events == exact.events)
    is_same &= exact.status != RayStatus.UNDECIDED
    is_undecided = ~is_same & (answers.status == RayStatus.UNDECIDED)
    error = np.where(is_same, np.abs(answers.st - exact.st).max(axis=1), 0.0)
    share = np.nan_to_num(error / allowed(exact, moved, level), nan=np.inf)
    if case.is_exact:
        share = np.where(error == 0.0, 0.0, np.inf)
    nowhere = is_same & ~moved.is_stable & (moved.spread == 0.0) & (exact.st != -1.0).any(axis=1)
    untold: set[int] = set(np.flatnonzero(nowhere).tolist())
    wrong = [*_impossible(answers), *_off(share, is_same)]
    needless = is_undecided & (expected.moved[finest].is_stable | case.is_exact)
    if case.lacks_values is not None:
        needless &= ~case.lacks_values
    wrong += [Wrong(ray=int(ray), what="is undecided without need") for ray in np.flatnonzero(needless)]
    others = set(np.flatnonzero(~is_same & ~is_undecided).tolist())
    guessed = _guessed(case, expected, others, level)
    wrong += [Wrong(ray=ray, what=f"is decided, and nothing tells how: {why}") for ray, why in guessed.items()]
    for ray in sorted(others - guessed.keys()):
        is_told, what = _path_beside(ray, exact, moved, answers, is_exact=case.is_exact)
        untold |= set() if is_told else {ray}
        wrong += [Wrong(ray=ray, what=what)] if what else []
    faulty = {each.ray for each in wrong}
    left = np.flatnonzero(is_undecided & ~needless)
    return Verdict(
        case=case,
        rays=len(share),
        worst=float(share.max(initial=0.0)) * ULPS,
        beside=len(others - untold - faulty),
        untold=len(untold - faulty),
        undecided=len(left),
        reasons=reasons.counted(case, expected, left, finest),
        needless=int(needless.sum()),
        wrong=tuple(sorted(wrong, key=lambda each: each.ray or 0)),
    )


def _guessed(case: Case, expected: Expected, rays: set[int], level: Level) -> dict[int, str]:
    """Return those of some rays that are undecidable however they are moved, and why; none where a case has no gaps."""
    if not case.has_gaps:
        return {}
    moved = expected.moved[level]
    known = set(moved.ray[moved.beside.status != RayStatus.UNDECIDED].tolist())
    dark = [ray for ray in rays - known if expected.answers.status[ray] == RayStatus.UNDECIDED]
    return {ray: reasons.reason(case, expected, ray, level) for ray in sorted(dark)}


def allowed(exact: Answers, moved: Moved, level: Level) -> Array:
    """Return how far each place may be off: what moves of `ULPS` roundings do, and the place's own last digit.

    It is inf where no move ends as the ray does, and nothing tells.
    """
    few = np.where(moved.is_stable, 1.0, _ALIKE)
    spread = np.where(~moved.is_stable & (moved.spread == 0.0), np.inf, moved.spread)
    return np.asarray(few * spread + ROUNDING[level] * np.maximum(np.abs(exact.st).max(axis=1), 1.0))


def _impossible(answers: Answers) -> Iterator[Wrong]:
    """Yield what cannot be, whatever the ray: numbers that are none, places of rays that have none."""
    lands = np.isin(answers.status, _LANDS)
    is_number = np.isfinite(answers.st).all(axis=1)
    for ray in np.flatnonzero(~is_number):
        yield Wrong(ray=int(ray), what=f"s, t are {answers.st[ray]}")
    for ray in np.flatnonzero(is_number & ~lands & (answers.st != -1.0).any(axis=1)):
        yield Wrong(ray=int(ray), what=f"has no place, yet s, t are {answers.st[ray]}")
    inside = ((answers.st >= 0.0) & (answers.st < 1.0)).all(axis=1)
    for ray in np.flatnonzero(lands & is_number & (inside != (answers.status == RayStatus.PICTURE))):
        yield Wrong(ray=int(ray), what=f"{_path(answers, ray)} does not go with s, t = {answers.st[ray]}")


def _off(share: Array, is_same: NDArray[np.bool_]) -> Iterator[Wrong]:
    for ray in np.flatnonzero(is_same & ~(share <= 1.0)):
        yield Wrong(
            ray=int(ray), what=f"lands {share[ray] * ULPS:.3g} roundings of its condition off; {ULPS} are allowed"
        )


def _path_beside(ray: int, exact: Answers, moved: Moved, answers: Answers, *, is_exact: bool) -> tuple[bool, str]:
    """Return whether a path that is not the exact one can be judged, and what is wrong with it.

    Whether and where the last leg meets the picture's plane is no other path.
    """
    taken = f"ends {_path(answers, ray)}"
    if is_exact or moved.is_stable[ray]:
        return True, f"{taken}; it must end {_path(exact, ray)}"
    known = np.flatnonzero((moved.ray == ray) & (moved.beside.status != RayStatus.UNDECIDED))
    seen = {_way(moved.beside, number) for number in known.tolist()}
    most = max((events for _, events in (*seen, _way(exact, ray))), default=0)
    if answers.events[ray] > most + _MORE_EVENTS and known.size:
        return True, f"{taken}; rays moved by {ULPS} roundings meet at most {most} surfaces"
    if _way(answers, ray) not in seen:
        is_reached = exact.status[ray] == RayStatus.UNDECIDED or _way(exact, ray) in seen
        is_between = min((events for _, events in seen), default=0) < answers.events[ray] < most
        if is_between or not is_reached or not 0 < len(seen) < _PATHS:
            return False, ""
        shown = sorted({_path(moved.beside, number) for number in known.tolist()})
        return True, f"{taken}; rays moved by {ULPS} roundings end {' or '.join(shown)}"
    alike = [number for number in known.tolist() if _way(moved.beside, number) == _way(answers, ray)]
    places = moved.beside.st[[number for number in alike if moved.beside.status[number] in _LANDS]]
    if len(places) < _FEW or answers.status[ray] not in _LANDS:
        return False, ""
    apart = float(np.abs(places - answers.st[ray]).max(axis=1).min())
    span = float((places.max(axis=0) - places.min(axis=0)).max())
    if apart > _ALIKE * span + 2.0**-20 * np.abs(places).max():
        return True, f"{taken}, {apart:.3g} beside all rays moved by {ULPS} roundings that do so"
    return True, ""


def _way(answers: Answers, ray: int) -> tuple[int, int]:
    """Return how a ray ends, leaving the lenses being one way, and how many surfaces it meets."""
    status = int(answers.status[ray])
    return (_LEAVES[0] if status in _LEAVES else status), int(answers.events[ray])


def _path(answers: Answers, ray: int | np.intp) -> str:
    return f"{RayStatus(int(answers.status[ray])).name} after {int(answers.events[ray])} events"
