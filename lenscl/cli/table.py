"""Tables for people, on standard output."""

from __future__ import annotations

from collections.abc import Sequence

import click


def print_table(head: Sequence[str], rows: Sequence[Sequence[str]], names: int) -> None:
    """Print columns as wide as they need; the first `names` are words and stand to the left, figures to the right."""
    widths = [max(len(row[k]) for row in (head, *rows)) for k in range(len(head))]
    for row in (head, *rows):
        cells = [
            cell.ljust(width) if k < names else cell.rjust(width)
            for k, (cell, width) in enumerate(zip(row, widths, strict=True))
        ]
        click.echo("  ".join(cells).rstrip())


def share(value: float) -> str:
    """Return a share as per cent."""
    return "0" if value == 0 else f"{100 * value:.2g} %"
