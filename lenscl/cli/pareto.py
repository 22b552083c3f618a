"""The command that shows what accuracy costs in time: pareto."""
# ruff: noqa: D301 - a backspace, not an escaped one, tells click to leave a paragraph as it is

from __future__ import annotations

import json
from math import isfinite
from pathlib import Path
from typing import TYPE_CHECKING

import click

from lenscl.cli.group import json_option, open_study, plain, set_option, study_argument
from lenscl.cli.table import print_table, share

if TYPE_CHECKING:
    from lenscl.accuracy import Front, Tried
    from lenscl.config import Accuracy

_LEAST_ROUNDS, _USUAL_ROUNDS = 6, 15  # fewer rounds than six bound no median
_NAMES = 3  # columns that name a row
_MARKS = {"front": "*", "noise": "~", "behind": "", "not eligible": "-"}


@click.command()
@study_argument
@click.option(
    "-o", "--out", type=click.Path(path_type=Path), metavar="DIR",
    help="Folder for pareto.csv, .png and .html; default out/<study>-pareto, below the current folder.",
)  # fmt: skip
@set_option
@click.option(
    "--rounds", type=click.IntRange(min=_LEAST_ROUNDS), default=_USUAL_ROUNDS, show_default=True,
    help="How often each combination is traced and timed.",
)  # fmt: skip
@json_option
def pareto(study_path: Path, out: Path | None, overrides: tuple[str, ...], rounds: int, as_json: bool) -> None:
    """Show time against error for every method and precision.

    The scene of a study is traced by every method in every precision, by the march with a range of steps and
    tolerances, and with Snell's law in its paraxial form. All are timed in turn, and their errors are measured
    against certified answers. The table marks the Pareto-optimal ones. The line below it names the one that a wanted
    accuracy needs: that of the study, or 0.05 px. Table, CSV and plots hold the same figures. It takes a minute or
    two, and needs lenscl[accuracy,plot].

    \b
    Example:
      lenscl pareto configs/torus.toml
      lenscl pareto configs/torus.toml --set lens.r=0.1 -o thin
    """
    from datetime import UTC, datetime

    from lenscl import device
    from lenscl.accuracy import circumstances, front_rows, front_sentence, largest_size, measure_front
    from lenscl.views import require_plotting

    require_plotting()  # said before a minute has gone
    study = open_study(study_path, overrides)
    folder = _made(out or Path("out") / f"{study_path.stem}-pareto")
    front = measure_front(
        study.scene,
        device.choose(),
        title=study.title,
        made=datetime.now(UTC).isoformat(timespec="seconds"),
        size=largest_size(study.scene, study.images),
        rounds=rounds,
        report=lambda text: click.echo(plain(text), err=True),
    )
    wanted = study.scene.numerics.accuracy
    for reason in front.left_out:
        click.echo(plain(reason), err=True)
    if as_json:
        click.echo(json.dumps({"rows": list(front_rows(front)), "sentence": front_sentence(front, wanted)}, indent=2))
    else:
        _print_front(front)
        click.echo(
            "\n* the front; ~ on it but for the noise; - not eligible, for too many rays end otherwise or are unknown\n"
        )
        for line in [*front_sentence(front, wanted).split("; "), "", *circumstances(front)]:
            click.echo(plain(line))
    _write(folder, front, wanted)


def _made(folder: Path) -> Path:
    """Return the folder, made if it is missing: what is wrong with it is said before a minute has gone."""
    from lenscl.errors import LensclError

    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise LensclError(f"{folder}: cannot be made: {error.strerror}; choose another with -o") from error
    return folder


def _write(folder: Path, front: Front, wanted: Accuracy | None) -> None:
    from lenscl.accuracy import front_csv
    from lenscl.imaging.atomic import whole_file
    from lenscl.views import write_front_page, write_front_picture

    text = front_csv(front).encode()
    with whole_file(folder / "pareto.csv", len(text)) as temporary:
        temporary.write_bytes(text)
    write_front_picture(folder / "pareto.png", front, wanted)
    write_front_page(folder / "pareto.html", front, wanted)
    click.echo(plain(f"{folder}: pareto.csv, pareto.png, pareto.html"), err=True)


def _print_front(front: Front) -> None:
    head = (
        "", "combination", "searches", "ns/ray", "from", "to", "error 99 %, px", "from", "to", "median", "largest",
        "scene units", "unknown", "differ", "colours", "escalated",
    )  # fmt: skip
    print_table(head, [_cells(front, each) for each in front.tried], _NAMES)


def _cells(front: Front, one: Tried) -> list[str]:
    judgement, high = one.judgement, one.judgement.pixels.high
    return [
        _MARKS[front.places[one.combination]],
        str(one.combination),
        "+".join(dict.fromkeys(one.searches)),
        *(f"{each:.1f}" for each in (one.time, *one.time_bounds)),
        *map(_error, (high.value, high.low, high.high, judgement.pixels.median.value, judgement.pixels.largest)),
        _error(judgement.units.high.value),
        *(share(each) for each in (judgement.unknown_share.value, one.differ, judgement.colours.value, one.escalated)),
    ]


def _error(value: float | None) -> str:
    """Return an error; a question mark for one that is not known."""
    return "?" if value is None or not isfinite(value) else f"{value:.1e}"
