"""The bands of kernels/interval_cbrt.cl enclose the cube root of a quadratic, where it starts, and its slope."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from probe import FORMS, REALS, Probe
from thinned import thinned

from lenscl.codegen import fragment
from lenscl.methods import METHODS

Array = NDArray[Any]
COUNT = 20_000
BODY = (
    "quadratic_t q;\nq.c[0] = in_0; q.c[1] = in_1; q.c[2] = in_2; q.error = in_3;\nconst cbrt_t root = cbrt_of(q);\n"
    + "".join(
        f"{{ const band_t b = {what}_of_cbrt(root); out_{i} = b.mid; out_{i + 1} = b.rise; out_{i + 2} = b.error; }}\n"
        for i, what in ((0, "band"), (3, "start"), (6, "slope"))
    )
)


def drawn(rng: np.random.Generator, dtype: Any) -> tuple[Array, Array]:
    """Return quadratics that are nowhere negative, shape (3, N) in long double, and as they come to be known, (4, N).

    Their lowest place is on the segment or far from it, their least value zero or nearly, or large.
    """
    size = 10.0 ** rng.uniform(-3, 3, COUNT)
    lowest = np.where(rng.random(COUNT) < 0.6, rng.uniform(-1.1, 1.1, COUNT), 10.0 ** rng.uniform(-1, 4, COUNT))
    least = rng.choice([0.0, 1.0, 1.0, 1.0], COUNT) * 10.0 ** rng.uniform(-9, 1, COUNT)
    bend = np.where(rng.random(COUNT) < 0.05, 0.0, size / np.maximum(1.0, lowest**2)).astype(np.longdouble)
    exact = np.stack([bend * lowest**2 + size * least, -2 * bend * lowest, bend])
    off = np.abs(exact).sum(0) * rng.choice([0.0, 1e-6, 1e-3, 1.0], COUNT) * 10.0 ** rng.uniform(-1, 0, COUNT)
    share = rng.dirichlet([1.0, 1.0, 1.0], COUNT).T * rng.choice([-1.0, 1.0], (3, COUNT))
    known = (exact + off * share).astype(dtype)
    sums = 4 * np.finfo(dtype).eps * np.abs(known).sum(0)  # what roundings of the sums that follow are part of it
    error = (1.01 * np.abs(known - exact).sum(0) + sums + np.finfo(dtype).tiny).astype(dtype)
    return exact, np.stack([*known, error]).astype(np.float64)


def bands(known: Array, precision: str, width: int, edit: Callable[[str], str] | None = None) -> Array:
    """Return shape (3, N, 3): mid, rise and error of the root, of its start and of its slope."""
    words = "\n".join(fragment(name) for name in METHODS["interval"].words)
    text = edit(words) if edit else words
    out: Array = Probe((), BODY, 4, 9, precision, width, text, is_plain=edit is not None)(*known)
    by_band: Array = out.reshape(-1, 3, 3).transpose(1, 0, 2).astype(np.longdouble)
    return by_band


def violations(precision: str, width: int, edit: Callable[[str], str] | None = None) -> dict[str, Array]:
    """Return for each band which values lie outside; lanes about which it says nothing do not."""
    rng = np.random.default_rng(3)
    exact, known = drawn(rng, REALS[precision])
    found = bands(known, precision, width, edit)
    outside = {what: np.zeros(COUNT, bool) for what in ("band", "start", "slope")}
    # The ends, the lowest place, where the slope is steepest (four times the least value), and others
    bend = np.maximum(exact[2], 1e-30)
    turn = -exact[1] / (2 * bend)
    steep = np.sqrt(3 * np.maximum(exact[0] + exact[1] * turn / 2, 0) / bend)
    places = [turn - steep, turn, turn + steep, *(rng.uniform(-1, 1, COUNT) for _ in range(30))]
    places = [np.full(COUNT, -1.0), np.full(COUNT, 1.0), *(np.clip(u, -1, 1) for u in places)]
    for u in places:
        u = u.astype(np.longdouble)
        value = np.maximum(exact[0] + u * (exact[1] + u * exact[2]), 0)
        with np.errstate(all="ignore"):
            slope = (exact[1] + 2 * u * exact[2]) / (3 * np.cbrt(value) ** 2)
        slope = np.where(np.isfinite(slope), slope, 0)
        values = {"band": np.cbrt(value), "slope": slope}
        if u.max() == -1:
            values["start"] = values["band"]
        for what, truth in values.items():
            mid, rise, error = found[("band", "start", "slope").index(what)].T
            own = 1e-17 * (np.abs(truth) + np.abs(mid) + np.abs(rise))  # this test's roundings
            outside[what] |= np.isfinite(error) & ~(np.abs(truth - (mid + rise * u)) <= error + own)
    return outside


@pytest.mark.parametrize(
    ("precision", "width"), thinned(FORMS, [("single", 1), ("single", 32), ("double", 2), ("double", 16)])
)
def test_every_value_lies_in_the_band(precision: str, width: int) -> None:
    for what, outside in violations(precision, width).items():
        assert not outside.any(), what
    _, known = drawn(np.random.default_rng(3), REALS[precision])
    said = np.isfinite(bands(known, precision, width)[..., 2])
    assert said[:2].all()
    assert said[2].sum() > COUNT // 2


def test_error_shrinks_with_the_square_of_the_segment() -> None:
    def error(half_length: float) -> Array:
        errors: Array = bands(np.array([[1.3], [half_length], [half_length**2], [0.0]]), "double", 1)[:, 0, 2]
        return errors

    wide, narrow = error(0.08), error(0.02)
    assert (narrow[[0, 2]] <= wide[[0, 2]] / 12.0).all()


def test_a_cusp_leaves_the_slope_known() -> None:
    """Through a least value of 1e-6 the slope is known to a tenth of what 1 / (3 q^(2/3)) q' could be."""
    mid, rise, error = bands(np.array([[1e-6], [0.0], [1.0], [1e-15]]), "double", 1)[2, 0]
    assert mid == rise == 0.0
    assert 4.5 < error < 4.7  # 2/3 0.6874 10, and it is 4.58 where q is 4e-6


def test_what_is_made_of_the_unknown_is_unknown() -> None:
    for unknown in (np.nan, np.inf):
        for i in range(4):
            known = np.array([[1.0], [0.1], [0.1], [1e-9]])
            known[i] = unknown
            assert not np.isfinite(bands(known, "double", 1)[..., 2]).any(), (unknown, i)


BROKEN = {
    "the chord's bulge forgotten": ("root.chord * climb * climb", "(realv)0", "band"),
    "q's doubt forgotten": ("(realv)3 * q.error + rounded", "rounded", "band"),
    "a start taken as a line": ("sixth + sixth + sixth * x", "sixth + sixth", "start"),
    "a wide start taken as narrow": ("x <= HALF ?", "x <= (realv)1.2 ?", "start"),
    "the curve taken as its chord": ("(share * a) * (share * a)", "(realv)0", "slope"),
    "the cusp cut off": ("NUMBER(0.6874)", "NUMBER(0.67)", "slope"),
    "a cusp seen where there is none": ("turns ? TOP_OF_CUSP", "bend < (realv)REAL_MAX ? TOP_OF_CUSP", "slope"),
    "c2's doubt forgotten": ("(bend + (realv)2 * q.error)", "bend", "slope"),
}


@pytest.mark.parametrize("fault", BROKEN)
def test_a_fault_in_the_bands_is_seen(fault: str) -> None:
    old, new, what = BROKEN[fault]

    def edit(text: str) -> str:
        assert old in text
        return text.replace(old, new)

    assert violations("double", 8, edit)[what].any()
