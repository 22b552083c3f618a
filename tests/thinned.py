"""Parameters that form a product, of which a part always runs and the whole with --slow.

What a kernel's test costs is the compiling of the kernel; so of a product of surfaces, methods, precisions and widths a
part is chosen that holds every value, and every pair where both might go wrong together.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterable
from typing import Any

import pytest


def thinned(rows: Iterable[Any], kept: Collection[Any] | Callable[..., bool]) -> list[Any]:
    """Return rows as parameters; those that are not among the kept ones, or not said to be kept, want --slow."""
    every = [row if isinstance(row, tuple) else (row,) for row in rows]
    if callable(kept):
        chosen = [kept(*row) for row in every]
    else:
        wanted = [row if isinstance(row, tuple) else (row,) for row in kept]
        assert all(row in every for row in wanted), "what is to be kept is no row"
        chosen = [row in wanted for row in every]
    assert any(chosen)
    return [
        pytest.param(*row, marks=[] if keeps else pytest.mark.slow) for row, keeps in zip(every, chosen, strict=True)
    ]
