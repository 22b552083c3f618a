"""Pair the rows of two runs: how times changed by their ratios to the frozen kernel, and errors beside them."""

from __future__ import annotations

from dataclasses import dataclass, fields
from typing import Literal

from lenscl.accuracy.bench.measurement import Circumstances, Measurement, Run

_KERNEL = "kernel_key"  # the one circumstance that may differ: it is what is compared


@dataclass(frozen=True, slots=True, kw_only=True)
class Change:
    """A row in two runs.

    Attributes
    ----------
    before, after : Measurement
    obstacles : tuple of str
        Why the times are not to be compared: the circumstances that differ.
    ratio : float or None
        Time after over time before, both taken relative to the frozen kernel run beside them, so that a machine that is
        slower today cancels. None where there are obstacles.
    low, high : float or None
        Between these it lies by what the rounds of both runs say: the ends of the intervals of their medians, divided
        so that they are widest apart.
    """

    before: Measurement
    after: Measurement
    obstacles: tuple[str, ...]
    ratio: float | None
    low: float | None
    high: float | None

    @property
    def verdict(self) -> Literal["slower", "faster", "same", "not comparable"]:
        """Whether the time changed by more than its own spread."""
        if self.low is None or self.high is None:
            return "not comparable"
        return "slower" if self.low > 1.0 else "faster" if self.high < 1.0 else "same"

    @property
    def is_same_kernel(self) -> bool:
        """Whether the very same text was timed twice: what changed is then not the program."""
        return self.before.circumstances.kernel_key == self.after.circumstances.kernel_key


@dataclass(frozen=True, slots=True, kw_only=True)
class Comparison:
    """Two runs, row by row; rows of only one of them by their names."""

    changes: tuple[Change, ...]
    only_before: tuple[tuple[str, str, str], ...]
    only_after: tuple[tuple[str, str, str], ...]


def compare(before: Run, after: Run) -> Comparison:
    """Pair the rows by scene, method and precision, in the order of `after`."""
    earlier = {each.row: each for each in before.measurements}
    later = {each.row: each for each in after.measurements}
    return Comparison(
        changes=tuple(_change(earlier[row], each) for row, each in later.items() if row in earlier),
        only_before=tuple(row for row in earlier if row not in later),
        only_after=tuple(row for row in later if row not in earlier),
    )


def _change(before: Measurement, after: Measurement) -> Change:
    obstacles = tuple(_obstacles(before.circumstances, after.circumstances))
    if obstacles:
        return Change(before=before, after=after, obstacles=obstacles, ratio=None, low=None, high=None)
    (least_before, most_before), (least_after, most_after) = before.ratio_bounds, after.ratio_bounds
    return Change(
        before=before,
        after=after,
        obstacles=(),
        ratio=after.ratio / before.ratio,
        low=least_after / most_before,
        high=most_after / least_before,
    )


def _obstacles(before: Circumstances, after: Circumstances) -> list[str]:
    pairs = {each.name: (getattr(before, each.name), getattr(after, each.name)) for each in fields(Circumstances)}
    differ = {name: pair for name, pair in pairs.items() if pair[0] != pair[1] and name != _KERNEL}
    return [f"{name.replace('_', ' ')} was {old}, is {new}" for name, (old, new) in differ.items()]
