"""What is not known of one leaf of F never makes a claim of another true: not as first operand, not as second."""

from __future__ import annotations

import itertools
import re
from collections import Counter
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from methods.bands import Bands
from methods.test_bands import CASES, COUNT, drawn, places
from numpy.typing import NDArray
from probe import REALS, Probe

from lenscl.codegen import fragment
from lenscl.codegen.bands import band_functions
from lenscl.lenses import user_surface
from lenscl.methods import METHODS

Array = NDArray[Any]

CUBE = ((-1.0, -1.0, -1.0), (1.0, 1.0, 1.0))
# Three leaves in every order: F, and what it is of theirs
JOINS: dict[str, Callable[[Array, Array, Array], Array]] = {
    "min(x, min(y, z))": lambda x, y, z: np.minimum(x, np.minimum(y, z)),
    "max(x, max(y, z))": lambda x, y, z: np.maximum(x, np.maximum(y, z)),
    "min(x, max(y, z))": lambda x, y, z: np.minimum(x, np.maximum(y, z)),
    "max(min(x, y), z)": lambda x, y, z: np.maximum(np.minimum(x, y), z),
}
CLAIMS = ("over", "turned", "closes", "one", "hold", "until")
ROWS = 800
GRID = np.linspace(0.0, 1.0, 401)  # of the segment
UNSURE = 0.01  # what a leaf here changes by from place to place, or less
NOTHING = list(itertools.product([0.3, 0.0, np.inf, -np.inf, np.nan], [0.2, np.inf, np.nan], [1e-9, np.inf, np.nan]))
UNKNOWN = np.array([each for each in NOTHING if not np.isfinite(each).all()])
# Of which bands a leaf's may be unknown: on the segment, at its start, its slope
HIDDEN = ("", "", "values slope", "values start slope", "values start slope", "slope", "values", "start slope")


def joins(precision: str) -> Probe:
    """Return `see_values` and `see_slopes` of every join, the leaves' bands being given."""
    reads, text, body = [], [], ["const maskv on_root = in_28 > (realv)0;", "const realv side = in_27;"]
    for kind, first in (("values", 0), ("starts", 3), ("slopes", 6)):
        for leaf in range(3):
            numbers = ", ".join(f"in_{9 * leaf + first + i}" for i in range(3))
            reads.append(f"const band_t {kind}_{leaf} = {{{numbers}}};")
    for i, join in enumerate(JOINS):
        name = f"s{i}"
        whole = band_functions(name, user_surface(join, [], CUBE), "double")
        joined = re.search(rf"#define {name}_LEAVES 3\n.*?\}}\n", whole, re.DOTALL)
        assert joined is not None
        text += [
            joined[0],
            f"typedef struct {{ real none; }} {name}_t;",
            f"typedef struct {{ band_t starts[3], slopes[3]; }} {name}_parts_t;",
            *(
                f"static inline void {name}_{kind[:-1]}_bands(const {name}_parts_t *parts, {name}_t shape,"
                f" band_t of[3]) {{ for (int k = 0; k < 3; ++k) of[k] = parts->{kind}[k]; }}"
                for kind in ("starts", "slopes")
            ),
            f"#define SURFACE(name) {name}_##name",
            *(fragment(each) for each in ("interval_leaf.cl", "interval_leaves.cl")),
            "#undef SURFACE",
        ]
        outs = [f"out_{len(CLAIMS) * i + j}" for j in range(len(CLAIMS))]
        body += [
            "{",
            f"const band_t bands[3] = {{{', '.join(f'values_{leaf}' for leaf in range(3))}}};",
            f"{name}_parts_t parts; {name}_t shape; shape.none = 0;",
            *(f"parts.{kind}[{leaf}] = {kind}_{leaf};" for kind in ("starts", "slopes") for leaf in range(3)),
            f"{name}_sight_t sight = {name}_see_values(bands, side, on_root, (realv)1);",
            f"{name}_see_slopes(&parts, shape, side, (maskv)(side != (realv)0), on_root, (maskv)0, (realv)1, HALF,",
            "(realv)(4 * REAL_EPSILON), &sight);",
            *(f"{out} = sight.{claim} ? (realv)1 : (realv)0;" for out, claim in zip(outs, CLAIMS[:4], strict=False)),
            f"{outs[4]} = sight.hold; {outs[5]} = sight.until;",
            "}",
        ]
    words = [fragment(name) for name in ("search.cl", *METHODS["interval"].words)]
    return Probe(
        (), "\n".join([*reads, *body]), 29, 4 * len(CLAIMS), precision, 4, "\n".join([*words, *text]), is_plain=True
    )


def a_segment(rng: np.random.Generator, dtype: Any) -> tuple[Array, Array, list[str], bool]:
    """Return three leaves' lines (3, 2), in t, their bands (27,), which are unknown, and if one starts at 0."""
    departs = bool(rng.random() < 0.3)
    line = rng.choice([-1.0, 1.0], (3, 2)) * rng.uniform(0.1, 1.0, (3, 2)) * [1.0, 2.5]
    if departs:
        line[rng.integers(3), 0] = 0.0
    line = line.astype(dtype).astype(float)
    fine = 64 * float(np.finfo(dtype).eps)
    hidden = [str(rng.choice(HIDDEN)) for _ in range(3)]
    bands = []
    for (at, rise), unknown in zip(line, hidden, strict=True):
        own = {
            "values": np.array([at + rise / 2, rise / 2, fine]),
            "start": np.array([at, 0.0, fine]),
            "slope": np.array([rise / 2, 0.0, fine]),
        }
        for kind in unknown.split():
            own[kind] = UNKNOWN[rng.integers(len(UNKNOWN))]
        bands += [*own["values"], *own["start"], *own["slope"]]
    return line, np.array(bands), hidden, departs


def what_a_leaf_may_be(line: Array, unknown: str) -> Array:
    """Return functions on the grid that the bands allow for, shape (N, grid)."""
    own = line[0] + line[1] * GRID
    found = [own]
    if "values" in unknown and "slope" in unknown:
        for start in (own[0],) if "start" not in unknown else (3.0, -3.0):
            for flip, end in itertools.product((0.0, 0.3, 2.0), (-4.0, 4.0)):
                found.append(np.where(GRID == 0.0, start, np.where(flip >= GRID, start or 1.0, end)))
    return np.stack(found)


def false_claims(join: str, said: Array, line: Array, hidden: list[str], side: float, departs: bool) -> list[str]:
    """Return what is claimed of F that some function does not do which is all that is known of it."""
    claims = dict(zip(CLAIMS, said, strict=True))
    x, y, z = (what_a_leaf_may_be(*each) for each in zip(line, hidden, strict=True))
    f = side * JOINS[join](x[:, None, None], y[:, None], z).reshape(-1, len(GRID))
    starts = (f[:, 0] == 0.0) & (f[:, 1] > 0.0) if departs else f[:, 0] > 0.0
    f = f[starts]  # as this ray is known to
    before = claims["until"] + GRID[1] >= GRID
    signs = np.where(np.abs(f[:, before]) > UNSURE, np.sign(f[:, before]), 0.0)
    turns = [np.count_nonzero(np.diff(row[row != 0.0])) for row in signs]
    after = f[:, before][:, -1]
    is_false = {
        "over": claims["over"] and (f < -UNSURE).any(),
        "turned": claims["turned"] and not claims["closes"] and (f[:, -1] > UNSURE).any(),
        "closes": claims["closes"] and (after > UNSURE).any(),
        "one": claims["one"] and max(turns, default=1) > 1,
        "hold": (f[:, claims["hold"] > GRID] < -UNSURE).any(),
    }
    return [name for name, wrong in is_false.items() if wrong]


@pytest.mark.parametrize("precision", ["single", "double"])
def test_no_join_of_leaves_claims_what_an_unknown_one_may_undo(precision: str) -> None:
    rng = np.random.default_rng(1)
    segments = [a_segment(rng, REALS[precision]) for _ in range(ROWS)]
    sides = rng.choice([-1.0, 1.0], ROWS)
    rows = np.array([[*bands, side, departs] for (_, bands, _, departs), side in zip(segments, sides, strict=True)])
    said = joins(precision)(*rows.T).reshape(ROWS, len(JOINS), len(CLAIMS))
    claims = Counter[str]()
    for (line, _, hidden, departs), side, of_each in zip(segments, sides, said, strict=True):
        for join, of_one in zip(JOINS, of_each, strict=True):
            wrong = false_claims(join, of_one, line, hidden, side, departs)
            assert not wrong, f"{join}: {wrong} of {line.tolist()}, unknown {hidden}, side {side}, departs {departs}"
            if any(hidden):
                claims.update(name for name, holds in zip(CLAIMS[:4], of_one, strict=False) if holds)
                claims["hold"] += bool(of_one[4] > 0)
    assert min(claims[name] for name in ("over", "turned", "closes", "one", "hold")) > 30, claims


@pytest.mark.parametrize("precision", ["single", "double"])
def test_every_operation_on_the_unknown_is_unknown_whichever_its_numbers(precision: str) -> None:
    band = Bands([expr for expr, _, _ in CASES.values()], precision, 4, edit=lambda text: text)
    tried = 0
    for other in ((0.2, 0.1, 0.0), (0.0, 0.0, 0.0), (-2.0, 0.0, 0.1), (1e30, 1e30, 0.0)):
        for unsure in ("x", "y", "z", "xy"):
            x, y, z = (UNKNOWN if axis in unsure else np.tile(other, (len(UNKNOWN), 1)) for axis in "xyz")
            for (name, (expr, _, _)), found in zip(CASES.items(), band(x, y, z, 1.5), strict=True):
                if name == "where" or not expr.depends_on(unsure):
                    continue  # a choice is one of its branches, and one of them is known
                assert not np.isfinite(found).all(axis=1).any(), (name, unsure, other)
                tried += len(UNKNOWN)
    assert tried > 8000


@pytest.mark.parametrize("precision", ["single", "double"])
def test_a_sign_at_a_pole_is_taken_for_no_value(precision: str) -> None:
    """From a bound on one side alone nothing is known of the other: the sign stands beside the largest number."""
    words = "\n".join(fragment(name) for name in METHODS["interval"].words)
    body = """
        const band_t a = {in_0, in_1, in_2}, bound = {in_3, (realv)0, in_4};
        const band_t falls = band_or_sign(a, bound, true), rises = band_or_sign(a, bound, false);
        out_0 = falls.mid; out_1 = falls.error; out_2 = rises.mid; out_3 = rises.error; out_4 = falls.rise;"""
    probe = Probe((), body, 5, 5, precision, 4, words, is_plain=True)
    levels = np.array([-1e-3, -0.5, 0.0, 0.2, 7.0, np.nan, np.inf, -np.inf])
    unknown = UNKNOWN[~np.isfinite(UNKNOWN[:, 2])]
    rows = np.array([[*a, level, 0.1] for a in unknown for level in levels])
    below, below_by, above, above_by, _ = np.asarray(probe(*rows.T)).reshape(len(rows), 5).T
    level = rows[:, 3]
    largest = float(np.finfo(REALS[precision]).max)
    told = below_by == 0.0
    np.testing.assert_array_equal(told, np.isfinite(level) & (level < -0.1))
    assert (below[told] == -largest).all()
    assert not np.isfinite(below_by[~told]).any()
    told = above_by == 0.0
    np.testing.assert_array_equal(told, np.isfinite(level) & (level > 0.1))
    assert (above[told] == largest).all()
    assert not np.isfinite(above_by[~told]).any()
    known = np.asarray(probe(*np.array([[0.3, 0.2, 1e-3, -5.0, 0.1]] * 4).T)).reshape(4, 5)[0]
    np.testing.assert_allclose(known, [0.3, 1e-3, 0.3, 1e-3, 0.2], rtol=1e-6)


@pytest.mark.parametrize("precision", ["single", "double"])
def test_bands_of_any_size_hold_their_values_or_are_unknown(precision: str) -> None:
    """What leaves the range of numbers inside an operation is unknown, and what is flushed to zero is counted."""
    largest = float(np.log10(np.finfo(REALS[precision]).max))
    said, exponents = Counter[str](), (1.5, -0.5, -3.0, 1 / 3)
    for sign in ("", "+"):
        rng = np.random.default_rng(5)
        names = [name for name in CASES if CASES[name][2] == sign]
        band = Bands([CASES[name][0] for name in names], precision, 4, edit=lambda text: text)
        sizes = 10.0 ** rng.uniform(10 - largest, largest - 2, (3, COUNT, 1))
        with np.errstate(over="ignore"):
            given = [drawn(rng, REALS[precision], sign) / 10.0 * size for size in sizes]
            x, y, z = (each.astype(REALS[precision]).astype(float) for each in given)
        x, y, z = (np.where(np.isfinite(each), each, 1.0) for each in (x, y, z))
        for exponent in exponents:
            k = np.full(COUNT, exponent, REALS[precision]).astype(float)
            for name, found in zip(names, band(x, y, z, k), strict=True):
                mid, rise, error = found.T.astype(np.longdouble)
                known = np.isfinite(found).all(axis=1)
                said[name] += int(known.sum())
                for _ in range(4):
                    u = places(rng).astype(np.longdouble)
                    with np.errstate(all="ignore"):
                        at = [b[:, 0] + b[:, 1] * u + b[:, 2] * places(rng).astype(np.longdouble) for b in (x, y, z)]
                        value = CASES[name][1](*at, k.astype(np.longdouble))
                        # This test's own roundings move the operands, and those of waves by more than all of a turn
                        far = (np.abs(at[0]) > 1e3) & (name in ("sin", "cos", "tan"))
                        own = 2.0**-58 * (np.abs(mid) + np.abs(rise) + error)
                        off = known & ~far & ~(np.abs(value - (mid + rise * u)) <= error + own)
                    assert not off.any(), (name, exponent, x[off][0], y[off][0], found[off][0])
    assert min(said.values()) > COUNT // 4, said
