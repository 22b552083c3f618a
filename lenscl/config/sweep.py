"""The points of a study: which combinations of values there are, and in what order.

Axes stand in the order written and the last varies fastest; zip groups come after the axes. `exclude` drops points,
then `include` adds its own. Everything is counted before any point is made.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field, replace
from numbers import Real
from typing import Any

from lenscl.config.axes import Axis, Span, read_axis
from lenscl.config.build import read_table
from lenscl.config.keys import overruled
from lenscl.config.problems import Report, key_text, short
from lenscl.config.read_lenses import LENS_KEYS
from lenscl.config.sampling import MOST_SHARES, shares
from lenscl.config.tables import TOP_KEYS, SweepTable

_SAME = 1e-9  # relative: 0.30000000000000004, as an axis computes it, is the 0.3 that a file excludes
_MOST_AXES = 1000
_MOST_TABLES = 10_000
_MOST_COMPARISONS = 20_000_000  # of points with tables of exclude
_MOST_SPELLED = 10**15

Group = tuple[tuple[str, Axis], ...]  # keys that vary together


@dataclass(frozen=True, slots=True, kw_only=True)
class Sweep:
    """What `[sweep]` describes; without axes there is the one point of the scene itself."""

    mode: str = "grid"
    samples: int = 1
    seed: int = 1
    max_points: int = 100_000
    axes: Group = ()
    zips: tuple[Group, ...] = ()
    exclude: tuple[Mapping[str, Any], ...] = ()
    include: tuple[Mapping[str, Any], ...] = ()
    fixed: Mapping[str, Any] = field(default_factory=dict)  # axes held at one value, by --set

    def axis_keys(self) -> tuple[str, ...]:
        """Return the keys that vary: axes, then zip groups, then what only an included point sets."""
        keys = [key for group in (self.axes, *self.zips) for key, _ in group]
        return tuple(dict.fromkeys([*keys, *(key for point in self.include for key in point)]))

    def most(self) -> int:
        """Return how many points there are before `exclude` drops any."""
        counts = [_count(group[0][1]) for group in self._grid()]
        samples = self.samples if self.mode != "grid" and self.axes else 1
        return samples * math.prod(counts) + len(self.include)

    def count(self, defaults: Mapping[str, Any]) -> int:
        """Return how many points there are."""
        return sum(1 for _ in self.rows(defaults)) if self.exclude else self.most()

    def rows(self, defaults: Mapping[str, Any]) -> Iterator[dict[str, Any]]:
        """Yield the values of every point, one key after another in the order of `axis_keys`.

        Parameters
        ----------
        defaults : mapping
            What the scene says for every key: an included point keeps it where it sets nothing.
        """
        keys = self.axis_keys()
        varied = {key for group in (self.axes, *self.zips) for key, _ in group}
        kept = {**defaults, **dict.fromkeys(overruled(defaults, varied))}
        for parts in itertools.product(self._samples(), *(_together(group) for group in self._grid())):
            values = dict.fromkeys(keys)
            values.update(kept)
            for part in parts:
                values.update(part)
            values.update(self.fixed)
            if not any(_matches(values, pattern) for pattern in self.exclude):
                yield values
        for point in self.include:
            yield {**dict.fromkeys(keys), **_kept(defaults, point), **point, **self.fixed}

    def hold(self, key: str, value: Any) -> Sweep:
        """Return the sweep with one of its axes held at a value; the other axes keep their values."""
        return replace(self, fixed={**self.fixed, key: value})

    def _grid(self) -> list[Group]:
        """Return the groups that are multiplied; one whose keys are all held would only repeat its points."""
        groups = [(axis,) for axis in self.axes] if self.mode == "grid" else []
        return [group for group in (*groups, *self.zips) if not all(key in self.fixed for key, _ in group)]

    def _samples(self) -> list[dict[str, Any]]:
        if self.mode == "grid" or not self.axes:
            return [{}]
        rows = shares(self.mode, self.samples, len(self.axes), self.seed)
        return [
            {key: axis.at(share) for (key, axis), share in zip(self.axes, row, strict=True) if isinstance(axis, Span)}
            for row in rows
        ]


def read_sweep(document: Mapping[str, Any], report: Report) -> Sweep:
    """Return the sweep of a document, after reporting what is wrong; the keys are judged against the scene later."""
    table = read_table(SweepTable, document, "sweep", report)
    if table is None:
        return Sweep()
    axes = _read_group(table.axes if table.axes is not None else {}, "sweep.axes", report)
    zips = [_read_zip(entry, at, report) for at, entry in _entries(table.zip, "sweep.zip", report)]
    sweep = Sweep(
        mode=table.mode,
        samples=table.samples or 1,
        seed=table.seed,
        max_points=table.max_points,
        axes=axes,
        zips=tuple(group for group in zips if group),
        exclude=tuple(entry for _, entry in _entries(table.exclude, "sweep.exclude", report)),
        include=tuple(entry for _, entry in _entries(table.include, "sweep.include", report)),
    )
    _check_mode(table, sweep, report)
    return sweep


def check_count(sweep: Sweep, report: Report) -> bool:
    """Report a sweep of too many points before any is made; return whether its keys are few enough to look at."""
    groups = {"axes": sweep.axis_keys(), "zip": sweep.zips, "exclude": sweep.exclude, "include": sweep.include}
    limits = {"axes": _MOST_AXES, "zip": _MOST_AXES, "exclude": _MOST_TABLES, "include": _MOST_TABLES}
    too_many = [name for name, group in groups.items() if len(group) > limits[name]]
    for name in too_many:
        report(f"sweep.{name}: at most {limits[name]} are supported, got {len(groups[name])}")
    most = sweep.most()
    if most > sweep.max_points:
        fix = f"thin the axes or raise sweep.max_points (now {sweep.max_points})"
        count = str(most) if most <= _MOST_SPELLED else f"more than {_MOST_SPELLED}"
        report(f"sweep.max_points: the sweep has {count} points; {fix}")
    elif sweep.mode != "grid" and sweep.samples * len(sweep.axes) > MOST_SHARES:
        report(f"sweep.samples: {sweep.samples} samples of {len(sweep.axes)} axes are more than {MOST_SHARES} values")
    elif most * len(sweep.exclude) > _MOST_COMPARISONS:
        report(f"sweep.exclude: {len(sweep.exclude)} tables against {most} points are too many; write fewer values")
    return not too_many


def _check_mode(table: SweepTable, sweep: Sweep, report: Report) -> None:
    sampled = sweep.mode != "grid"
    if sampled and table.samples is None:
        report(f"sweep.samples: is required where sweep.mode is {short(sweep.mode)}")
    if sampled and not table.axes:
        report(f"sweep.axes: is required where sweep.mode is {short(sweep.mode)}: keys with {{ min, max }}")
    if not sampled and table.samples is not None:
        report('sweep.samples: is read only by the modes "latin", "halton", "sobol" and "random"; set sweep.mode')
    for key, axis in sweep.axes:
        if sampled and not isinstance(axis, Span):
            shape = "{ min = ..., max = ... }"
            report(f"sweep.axes.{key_text(key)}: must be {shape} where sweep.mode is {short(sweep.mode)}")
        elif not sampled and isinstance(axis, Span):
            report(
                f'sweep.axes.{key_text(key)}: {{ min, max }} needs sweep.mode = "latin", "halton", "sobol" or "random"'
            )


def _read_group(written: Any, at: str, report: Report) -> Group:
    if isinstance(written, list) and written and all(isinstance(entry, dict) for entry in written):
        report(f"{at}: is a single table, written [{at}], with single brackets")
        return ()
    if not isinstance(written, dict):
        report(f"{at}: must be a table of keys and their values, got {short(written)}")
        return ()
    found = []
    for key, value in written.items():
        if key in TOP_KEYS and isinstance(value, dict):
            inner = key_text(next(iter(value), "key"))
            report(f'{at}.{key}: put the whole key in quotes: "{key}.{inner}" = ...')
            continue
        try:
            found.append((key, read_axis(value)))
        except ValueError as error:
            report(f"{at}.{key_text(key)}: {error}")
    return tuple(found)


def _read_zip(written: dict[str, Any], at: str, report: Report) -> Group:
    group = _read_group(written, at, report)
    for key, axis in group:
        if isinstance(axis, Span):
            report(f"{at}.{key_text(key)}: must be values that can be paired, not {{ min, max }}")
            return ()
    counts = {key: _count(axis) for key, axis in group}
    if len(set(counts.values())) > 1:
        listed = ", ".join(f"{key_text(key)} has {short(count)}" for key, count in list(counts.items())[:8])
        report(f"{at}: keys that vary together must have equally many values, but {listed}")
        return ()
    return group


def _entries(written: Any, at: str, report: Report) -> Iterator[tuple[str, dict[str, Any]]]:
    if written is None:
        return
    if isinstance(written, dict):
        report(f"{at}: is a list of tables, written [[{at}]], with double brackets")
    elif not isinstance(written, list) or not all(isinstance(entry, dict) for entry in written):
        report(f"{at}: must be tables [[{at}]], got {short(written)}")
    else:
        for place, entry in enumerate(written):
            if entry:
                yield f"{at}[{place}]", entry
            else:
                report(f"{at}[{place}]: must have a key at least; leave the empty table out")


def _kept(defaults: Mapping[str, Any], point: Mapping[str, Any]) -> dict[str, Any]:
    """Return the defaults of an included point, None where the point decides.

    A surface of its own has its own parameters, which are left open.
    """
    overruled_keys = overruled(defaults, point)
    lenses = tuple(key.removesuffix("surface") for key in point if key.endswith(".surface"))
    return {
        key: None
        if key in overruled_keys or (key.startswith(lenses) and key.split(".")[-1] not in (*LENS_KEYS, *"xyz"))
        else value
        for key, value in defaults.items()
    }


def _count(axis: Axis) -> int:
    return 1 if isinstance(axis, Span) else axis.count


def _together(group: Group) -> list[dict[str, Any]]:
    """Return the rows of keys that vary together."""
    makers: list[Callable[[], tuple[Any, ...]]] = [axis.make for _, axis in group if not isinstance(axis, Span)]
    keys = [key for key, _ in group]
    return [dict(zip(keys, row, strict=True)) for row in zip(*(make() for make in makers), strict=True)]


def _matches(values: Mapping[str, Any], pattern: Mapping[str, Any]) -> bool:
    return all(_same(values[key], wanted) for key, wanted in pattern.items())


def _same(a: Any, b: Any) -> bool:
    if type(a) is float and type(b) is float:  # the common case, spelled out for speed
        return abs(a - b) <= _SAME * max(abs(a), abs(b))
    if isinstance(a, bool) or isinstance(b, bool):
        return a is b
    if isinstance(a, Real) and isinstance(b, Real):
        try:
            return math.isclose(a, b, rel_tol=_SAME)
        except OverflowError:  # a whole number that no float can hold
            return a == b
    if isinstance(a, list | tuple) and isinstance(b, list | tuple):
        return len(a) == len(b) and all(_same(p, q) for p, q in zip(a, b, strict=True))
    return type(a) is type(b) and bool(a == b)
