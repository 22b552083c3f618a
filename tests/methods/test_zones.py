"""Zones of a leaf of low degree along the ray: every place where it may be zero, and its sign beside them."""

from __future__ import annotations

from fractions import Fraction

import numpy as np
import pytest
from numpy.typing import NDArray
from probe import Probe

from lenscl.codegen import fragment

PRECISIONS = ["single", "double"]
EPS = {"single": 2.0**-23, "double": 2.0**-52}
BODY = """
  const realv a[3] = {in_0, in_1, in_2};
  zone_t second;
  const zone_t zone = zones_of(a, in_3, &second);
  out_0 = zone.sign; out_1 = zone.low; out_2 = zone.high; out_3 = zone.flips ? (realv)1 : (realv)0;
  out_4 = second.low; out_5 = second.high; out_6 = second.flips ? (realv)1 : (realv)0;
"""
PLACES = [Fraction(k, 16) for k in range(17)]


def zones_of(
    precision: str, a: NDArray[np.float64], noise: NDArray[np.float64], fault: tuple[str, str] = ("", "")
) -> NDArray[np.float64]:
    text = fragment("zones.cl")
    assert not fault[0] or text.count(fault[0]) == 1, "the kernel has changed"
    whole = text.replace(*fault) if fault[0] else text
    return Probe((), BODY, 4, 7, precision, 4, before=whole, is_plain=True)(*a.T, noise)


def polynomials(seed: int, precision: str) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return coefficients of roots anywhere, equal, near an end, or far; lines, constants; and a noise of 1 to 2."""
    rng = np.random.default_rng(seed)
    count = 400
    one, other = rng.uniform(-0.6, 1.6, (2, count))
    near = rng.random(count) < 0.5
    one[near] = rng.choice([0.0, 1.0, 0.5], near.sum()) + rng.normal(size=near.sum()) * 10.0 ** rng.uniform(
        -17, -1, near.sum()
    )
    twins = rng.random(count) < 0.3
    other[twins] = one[twins] + 10.0 ** rng.uniform(-12, -1, twins.sum())
    size = 10.0 ** rng.uniform(1, -np.log10(EPS[precision]) - 1, count) * rng.choice([-1.0, 1.0], count)
    a = size[:, None] * np.stack([one * other, -one - other, np.ones(count)], axis=1)
    lines = rng.random(count) < 0.2
    a[lines] = (size[:, None] * np.stack([-one, np.ones(count), np.zeros(count)], axis=1))[lines]
    constant = rng.random(count) < 0.05
    a[constant, 1:] = 0.0
    kind = np.float32 if precision == "single" else np.float64
    return a.astype(kind).astype(np.float64), rng.uniform(1, 2, count).astype(kind).astype(np.float64)


def faults(precision: str, fault: tuple[str, str] = ("", "")) -> tuple[int, int, int]:
    """Count zones that say a thing which is not so, crossings that were told, and touches."""
    a, noise = polynomials(7, precision)
    wrong = told = touches = 0
    for (a0, a1, a2), n, row in zip(a, noise, zones_of(precision, a, noise, fault), strict=True):
        if row[0] == 0:  # nothing is told
            touches += 1
            continue
        exact = [Fraction(each) for each in (a0, a1, a2)]
        zones = [(low, high, flips) for low, high, flips in (row[1:4], row[4:7]) if low < 2.0]
        sign, places = row[0], sorted({*PLACES, *(Fraction(end) for zone in zones for end in zone[:2])})
        for place in (each for each in places if 0 <= each <= 1):
            if any(Fraction(low) < place < Fraction(high) for low, high, _ in zones):
                continue
            crossed = [flips for _, high, flips in zones if Fraction(high) <= place]
            unknown = any(not flips for flips in crossed) and not all(crossed)
            value = exact[0] + place * (exact[1] + place * exact[2])
            expected = sign * (-1) ** sum(bool(flips) for flips in crossed)
            wrong += not unknown and expected * value < -n  # the true one may be as far off
            wrong += not unknown and abs(value) > n and (value > 0) != (expected > 0)
        told += sum(bool(flips) for *_, flips in zones)
        touches += sum(not flips for *_, flips in zones)
    return wrong, told, touches


@pytest.mark.parametrize("precision", PRECISIONS)
def test_outside_of_its_zones_a_parabola_has_the_sign_that_is_told(precision: str) -> None:
    wrong, told, touches = faults(precision)
    assert wrong == 0
    assert told > 200
    assert touches > 20


@pytest.mark.parametrize(
    ("old", "new"),
    [
        ("never | (behind[i] & (low <= (realv)0))", "never"),  # a root behind the start is crossed once more
        ("(realv)2 * (abs_v(a[0] + t", "(realv)NUMBER(0.01) * (abs_v(a[0] + t"),
        ("(square < -doubt)", "(square < (realv)1e3f * doubt)"),
        ("starts_on ? falls : own", "falls"),
    ],
)
def test_broken_zones_are_noticed(old: str, new: str) -> None:
    assert faults("single", (old, new))[0] > 0


@pytest.mark.parametrize("precision", PRECISIONS)
def test_a_zone_is_no_wider_than_rounding_makes_it(precision: str) -> None:
    rng = np.random.default_rng(3)
    one, size = rng.uniform(0.1, 0.9, 200), 2.0 ** rng.integers(4, 12, 200) / EPS[precision] ** 0.5
    other = one + rng.choice([-1.0, 1.0], 200) * 2.0
    a = size[:, None] * np.stack([one * other, -one - other, np.ones(200)], axis=1)
    found = zones_of(precision, a, np.ones(200))
    assert (found[:, 3] == 1).all()
    assert (found[:, 4] == 2).all()
    assert (found[:, 2] - found[:, 1] < 30.0 / size + 60 * EPS[precision]).all()
    assert (np.abs(0.5 * (found[:, 1] + found[:, 2]) - one) < 30.0 / size + 60 * EPS[precision]).all()
