"""The axes of a sweep: how the values of one key are written, and the arithmetic that makes them.

Counts are known before any value is made, so that an axis of 10^9 values is refused, not built.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Literal, cast

from lenscl.config.checks import Number, Whole
from lenscl.config.problems import short

_HIT = 1e-9  # of a step: a stop this near to a value of a range is that value
_LONGEST_COUNT = 10**15  # what a float still counts exactly; far more than any study takes


@dataclass(frozen=True, slots=True)
class Values:
    """An axis written as the list of its values."""

    values: tuple[Any, ...]

    @property
    def count(self) -> int:
        """How many values there are."""
        return len(self.values)

    def make(self) -> tuple[Any, ...]:
        """Return the values."""
        return self.values


@dataclass(frozen=True, slots=True)
class Linspace:
    """`count` values from start to stop, both ends in, computed as numpy.linspace does."""

    start: float
    stop: float
    count: int

    def make(self) -> tuple[float, ...]:
        """Return the values."""
        if self.count == 1:
            return (self.start,)
        step = (self.stop - self.start) / (self.count - 1)
        return (*(i * step + self.start for i in range(self.count - 1)), self.stop)


@dataclass(frozen=True, slots=True)
class Logspace:
    """`count` values from start to stop, both ends in, in a constant ratio; the ends are values, not exponents."""

    start: float
    stop: float
    count: int

    def make(self) -> tuple[float, ...]:
        """Return the values."""
        if self.count == 1:
            return (self.start,)
        low, high = math.log10(self.start), math.log10(self.stop)
        inner = (10.0 ** (low + (high - low) * (i / (self.count - 1))) for i in range(1, self.count - 1))
        return (self.start, *inner, self.stop)


@dataclass(frozen=True, slots=True)
class Range:
    """start, start + step, ... up to stop, which is in when a step hits it; whole numbers stay whole."""

    start: float
    stop: float
    step: float

    @property
    def count(self) -> int:
        """How many values there are; 0 where the step leads away from the stop."""
        steps = (self.stop - self.start) / self.step
        return 0 if steps < -_HIT else math.floor(min(steps + _HIT, _LONGEST_COUNT)) + 1

    def make(self) -> tuple[float, ...]:
        """Return the values."""
        values = [self.start + i * self.step for i in range(self.count)]
        if abs(self.stop - values[-1]) <= _HIT * abs(self.step):
            values[-1] = self.stop
        return tuple(values)


@dataclass(frozen=True, slots=True)
class Span:
    """All values from low to high, for the sampled modes; `log` spreads samples evenly over the exponents."""

    low: float
    high: float
    scale: Literal["linear", "log"]

    def at(self, share: float) -> float:
        """Return the value at a share in [0, 1] of the way."""
        if self.scale == "log":
            value = math.exp(math.log(self.low) * (1.0 - share) + math.log(self.high) * share)
        else:
            value = self.low * (1.0 - share) + self.high * share
        return min(max(value, self.low), self.high)


Axis = Values | Linspace | Logspace | Range | Span
_NUMBER = Number()
_EXAMPLE = (
    "a list of values, { linspace = [start, stop, count] }, { logspace = [...] } or { range = [start, stop, step] }"
)


def read_axis(written: Any) -> Axis:
    """Return the axis that a value of `[sweep.axes]` describes.

    Raises
    ------
    ValueError
        With what is wrong; the caller knows the key.
    """
    if isinstance(written, list | tuple):
        if not written:
            raise ValueError("must have a value at least, got an empty list")
        return Values(tuple(written))
    if not isinstance(written, dict):
        raise ValueError(f"must be {_EXAMPLE}, got {short(written)}; a single value is written [{short(written)}]")
    if "min" in written or "max" in written:
        return _span(written)
    if len(written) != 1 or next(iter(written)) not in _KINDS:
        keys = ", ".join(short(key) for key in list(written)[:4])
        raise ValueError(f"must be {_EXAMPLE}, got a table with {keys or 'no keys'}")
    kind, numbers = next(iter(written.items()))
    if not isinstance(numbers, list | tuple) or len(numbers) != 3:
        raise ValueError(f"{kind} must be {_KINDS[kind][0]}, got {short(numbers)}")
    return _KINDS[kind][1](*numbers)


def _checked(what: str, check: Callable[[Any], Any], value: Any) -> Any:
    try:
        return check(value)
    except ValueError as error:  # PydanticCustomError is one
        raise ValueError(f"{what} {error}") from None


def _ends(kind: str, start: Any, stop: Any) -> tuple[float, float]:
    return _checked(f"{kind} start", _NUMBER, start), _checked(f"{kind} stop", _NUMBER, stop)


def _count(kind: str, count: Any) -> int:
    return cast(int, _checked(f"{kind} count", Whole(1, _LONGEST_COUNT), count))


def _linspace(start: Any, stop: Any, count: Any) -> Linspace:
    return Linspace(*_ends("linspace", start, stop), _count("linspace", count))


def _logspace(start: Any, stop: Any, count: Any) -> Logspace:
    a, b = _ends("logspace", start, stop)
    if not (a > 0.0 and b > 0.0):
        raise ValueError(f"logspace takes two positive end values, not exponents, got {short([start, stop])}")
    return Logspace(a, b, _count("logspace", count))


def _range(start: Any, stop: Any, step: Any) -> Range:
    a, b = _ends("range", start, stop)
    h = _checked("range step", _NUMBER, step)
    if h == 0.0:
        raise ValueError("range step must not be 0")
    if all(isinstance(value, int) for value in (start, stop, step)):
        a, b, h = start, stop, step
    if Range(a, b, h).count == 0:
        raise ValueError(f"range has no values: a step of {short(step)} leads away from {short(stop)}")
    return Range(a, b, h)


def _span(written: dict[str, Any]) -> Span:
    unknown = [key for key in written if key not in ("min", "max", "scale")]
    if unknown or "min" not in written or "max" not in written:
        keys = ", ".join(short(key) for key in list(written)[:4])
        raise ValueError(f'must be {{ min = ..., max = ..., scale = "linear" or "log" }}, got a table with {keys}')
    low, high = _checked("min", _NUMBER, written["min"]), _checked("max", _NUMBER, written["max"])
    scale = written.get("scale", "linear")
    if scale not in ("linear", "log"):
        raise ValueError(f'scale must be "linear" or "log", got {short(scale)}')
    if not low <= high:
        raise ValueError(f"min must not exceed max, got {short(written['min'])} and {short(written['max'])}")
    if scale == "log" and not low > 0.0:
        raise ValueError(f'min must be positive where scale is "log", got {short(written["min"])}')
    return Span(low, high, scale)


_KINDS: dict[str, tuple[str, Callable[[Any, Any, Any], Axis]]] = {
    "linspace": ("[start, stop, count]", _linspace),
    "logspace": ("[start, stop, count], the end values", _logspace),
    "range": ("[start, stop, step]", _range),
}
