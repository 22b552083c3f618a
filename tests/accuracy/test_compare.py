from __future__ import annotations

from dataclasses import fields

import pytest
from hypothesis import given
from hypothesis import strategies as st

from lenscl.accuracy.bench import Circumstances, compare

ROUNDS = (0.98, 1.0, 1.02, 0.99, 1.01, 1.0, 0.97, 1.03, 1.0)


def scaled(factor: float) -> tuple[float, ...]:
    return tuple(factor * each for each in ROUNDS)


@given(st.floats(0.1, 10), st.floats(0.1, 10))
def test_the_change_is_that_of_the_ratios_whatever_the_seconds_are(measurement, run, factor, machine) -> None:
    before = run(measurement(ratios=scaled(2.0)))
    after = run(measurement(ratios=scaled(2.0 * factor), ns_least=80 * machine, ns_median=82 * machine))
    (change,) = compare(before, after).changes
    assert change.ratio == pytest.approx(factor)
    assert change.low == pytest.approx(factor * 0.98 / 1.02)
    assert change.high == pytest.approx(factor * 1.02 / 0.98)
    expected = "slower" if factor > 1.0409 else "faster" if factor < 0.9607 else "same"
    assert change.verdict == expected or min(abs(factor - edge) for edge in (1.0408, 0.9608)) < 1e-3


def test_a_run_against_itself_is_the_same(measurement, run) -> None:
    one = run(measurement(ratios=ROUNDS), measurement(method="march", ratios=scaled(3.0)))
    comparison = compare(one, one)
    assert [change.verdict for change in comparison.changes] == ["same", "same"]
    assert all(change.ratio == 1.0 and change.is_same_kernel for change in comparison.changes)
    assert comparison.only_before == comparison.only_after == ()


@pytest.mark.parametrize("name", [each.name for each in fields(Circumstances)])
def test_every_circumstance_but_the_kernel_keeps_times_apart(measurement, run, name: str) -> None:
    before, after = measurement(ratios=ROUNDS), measurement(ratios=scaled(0.5), **{name: "another"})
    (change,) = compare(run(before), run(after)).changes
    if name == "kernel_key":
        assert (change.obstacles, change.verdict, change.is_same_kernel) == ((), "faster", False)
    else:
        was = getattr(before.circumstances, name)
        assert change.obstacles == (f"{name.replace('_', ' ')} was {was}, is another",)
        assert (change.ratio, change.low, change.high, change.verdict) == (None, None, None, "not comparable")
    assert change.before.error == before.error  # accuracy stands beside it all the same


def test_rows_are_paired_by_scene_method_and_precision_in_the_later_order(measurement, run) -> None:
    names = [("a", "auto", "single"), ("a", "auto", "double"), ("a", "march", "single"), ("b", "auto", "single")]
    rows = {
        name: measurement(scene=name[0], method=name[1], precision=name[2], ratios=scaled(number))
        for number, name in enumerate(names, start=1)
    }
    comparison = compare(run(*(rows[name] for name in names[:3])), run(*(rows[name] for name in reversed(names[1:]))))
    assert [change.after.row for change in comparison.changes] == [names[2], names[1]]
    assert all(change.ratio == 1.0 for change in comparison.changes)
    assert comparison.only_before == (names[0],)
    assert comparison.only_after == (names[3],)
