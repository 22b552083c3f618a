"""Compute the band of an expression from Python: `kernels/interval.cl` with the text written for the expression."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray
from probe import Probe

from lenscl.codegen import fragment
from lenscl.expr import OPERATIONS, Expr, band_text
from lenscl.methods import METHODS

Array = NDArray[Any]
SYMBOLS = {"x": "x", "y": "y", "z": "z", "k": "k"}


class Bands:
    """Expressions' bands in x, y, z (bands) and k (an exact number), as functions of theirs, in one program.

    What is edited is built plainly: it only has to be seen to be wrong.
    """

    def __init__(
        self,
        expressions: Sequence[Expr],
        precision: str,
        width: int,
        edit: Callable[[str], str] | None = None,
    ) -> None:
        body = [
            f"const band_t {name} = {{in_{i}, in_{i + 1}, in_{i + 2}}};"
            for name, i in zip("xyz", (0, 3, 6), strict=True)
        ]
        body += ["const realv k = in_9;"]
        for i, expr in enumerate(expressions):
            text = band_text({"band": expr}, symbols=SYMBOLS, bands="xyz", precision=precision)  # type: ignore[arg-type]
            body += ["{", *text.statements, f"const band_t c = {text.results['band']};"]
            body += [f"out_{3 * i} = c.mid; out_{3 * i + 1} = c.rise; out_{3 * i + 2} = c.error;", "}"]
        more = tuple(dict.fromkeys(name for row in OPERATIONS.values() for name in row.fragments))
        bands = (f"interval_{name}" for name in more)
        words = "\n".join(fragment(name) for name in (*more, *METHODS["interval"].words, *bands))
        count = 3 * len(expressions)
        before = edit(words) if edit else words
        self._probe = Probe((), "\n".join(body), 10, count, precision, width, before, is_plain=edit is not None)

    def __call__(self, x: Array, y: Array, z: Array, k: ArrayLike = 0.0) -> Array:
        """Return shape (expressions, N, 3): mid, rise, error; x, y, z likewise."""
        columns = np.broadcast_arrays(*np.transpose(x), *np.transpose(y), *np.transpose(z), np.asarray(k, float))
        out: Array = self._probe(*columns)
        by_expression: Array = out.reshape(len(out), -1, 3).transpose(1, 0, 2)
        return by_expression
