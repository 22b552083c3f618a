"""The commands of a sweep: sweep itself, and export of what it has noted."""
# ruff: noqa: D301 - a backspace, not an escaped one, tells click to leave a paragraph as it is

from __future__ import annotations

from collections.abc import Mapping
from contextlib import ExitStack, closing
from itertools import chain
from pathlib import Path
from typing import TYPE_CHECKING

import click

from lenscl.cli.group import (
    INTERRUPTED,
    SOME_FAILED,
    many,
    open_study,
    plain,
    set_option,
    study_argument,
    tell_stretched,
)

if TYPE_CHECKING:
    from lenscl.sweep import Stage, SweepPlan

_MOST_NAMED = 10  # failures named one by one in a summary


@click.command()
@study_argument
@click.option(
    "-o", "--out", type=click.Path(path_type=Path), metavar="DIR",
    help="Folder for images and table; default out/<study>, below the current folder.",
)  # fmt: skip
@click.option("--dry-run", is_flag=True, help="List points, pictures, outputs and kernels as CSV; make nothing.")
@click.option("--fresh", is_flag=True, help="Remove the results of earlier runs in the folder, and start over.")
@set_option
def sweep(study_path: Path, out: Path | None, dry_run: bool, fresh: bool, overrides: tuple[str, ...]) -> None:
    """Paint every picture through every point of a study.

    A sweep resumes where an earlier run of it ended: it makes what is missing, failed or changed. Rows go to standard
    output as CSV, one for each point and picture; progress and a summary go to standard error. A picture or point
    that fails does so alone, and the exit code is then 3. If the self-checks of a point fail, its images are kept,
    its rows say so under `error`, in later runs too, and the exit code is 3.

    What no image could be made without (a device, room on the disk, the folder) ends the sweep with exit code 1, or 4
    for the device; what was made is noted, and the same command goes on from there.

    \b
    Example:
      lenscl sweep configs/torus.toml
      lenscl sweep configs/torus.toml -o out/thin --set lens.r=0.1 > thin.csv
      lenscl sweep configs/torus.toml --dry-run
    """
    from lenscl.sweep import plan_sweep

    plan = plan_sweep(open_study(study_path, overrides), out)
    if dry_run:
        _list(plan)
    else:
        _run(plan, fresh)


@click.command()
@click.argument("folder", metavar="OUT", type=click.Path(path_type=Path))
@click.option("--csv", "as_csv", is_flag=True, help="Write CSV, in the form that sweep prints.")
@click.option("--parquet", "as_parquet", is_flag=True, help="Not available in this version.")
@click.argument("file", metavar="[FILE]", required=False, type=click.Path(path_type=Path))
def export(folder: Path, as_csv: bool, as_parquet: bool, file: Path | None) -> None:
    """Write the table of a sweep as CSV.

    The table goes to FILE, or to standard output. Rows that are not made yet have neither output nor error.

    \b
    Example:
      lenscl export out/torus --csv
      lenscl export out/torus --csv torus.csv
    """
    from lenscl.errors import LensclError
    from lenscl.sweep import Store, csv_lines

    if as_parquet:
        raise click.UsageError("--parquet is not available in this version; use --csv")
    if not as_csv:
        raise click.UsageError("say in which form: --csv")
    with ExitStack() as stack:
        store = stack.enter_context(Store.reading(folder))
        lines = csv_lines(store.rows(), store.about("axes"), folder, accuracy=bool(store.about("accuracy")))
        if file is None:
            for line in lines:
                click.echo(line)
            return
        try:
            with file.open("w", encoding="utf-8", newline="") as table:
                table.writelines(f"{line}\n" for line in lines)
        except OSError as error:
            raise LensclError(f"{file}: cannot be written: {error.strerror}") from error


def _list(plan: SweepPlan) -> None:
    """Print what a sweep would do."""
    from lenscl.sweep import Row, cells, csv_line
    from lenscl.tracing import kernel_source

    axes = plan.study.axes
    click.echo(csv_line(["index", *axes, "picture", "output", "kernel"]))
    kernels: dict[str, str] = {}
    for point, structure in plan.structures():
        if structure not in kernels:
            by_accuracy = point.scene.numerics.accuracy is not None
            kernels[structure] = "" if by_accuracy else kernel_source(plan.scene_of(point)).key
        for run in plan.runs_of(point):
            shown = Row(output=run.output, index=run.point, values=run.values, picture=run.picture, state="pending")
            start = cells(shown, axes)[: len(axes) + 2]
            click.echo(csv_line([*start, str(plan.out / run.output), kernels[structure]]))
    known = many(len(set(kernels.values()) - {""}), "kernel")
    chosen = "numerics.accuracy chooses kernels when it runs" if plan.asks_accuracy else known
    click.echo(f"{_size(plan)}; {chosen}; nothing was made", err=True)
    for picture in plan.pictures:
        if picture.error is not None:
            click.echo(plain(f"unreadable: {picture.error}"), err=True)


def _size(plan: SweepPlan) -> str:
    points, pictures = many(plan.point_count, "point"), many(len(plan.pictures), "picture")
    return plain(f"{points} x {pictures} = {many(plan.run_count, 'image')} in {plan.out}")


def _shares(spans: Mapping[Stage, float]) -> str:
    """Return how the work of all threads divides into stages, the largest first; waiting is no work."""
    work = {stage: seconds for stage, seconds in spans.items() if stage != "wait"}
    whole = sum(work.values()) or 1.0
    largest_first = sorted(work.items(), key=lambda item: -item[1])
    shares = [f"{stage} {100 * seconds / whole:.0f} %" for stage, seconds in largest_first if seconds >= 0.005 * whole]
    return f"stages: {', '.join(shares)} of {whole:.1f} s in all threads"


def _run(plan: SweepPlan, fresh: bool) -> None:
    from lenscl.cli.findings import PointFindings
    from lenscl.cli.interrupt import Interrupt
    from lenscl.cli.progress import Progress
    from lenscl.sweep import Store, cells, csv_line, header, run_sweep, shown_scenes, total_spans

    click.echo(_size(plan), err=True)
    tell_stretched(shown_scenes(plan.study), plan.study.images)
    axes = plan.study.axes
    made = kept = 0
    failed: list[str] = []
    spans: dict[Stage, float] = {}
    findings = PointFindings()
    with (
        Interrupt() as interrupt,
        Progress(plan.run_count) as progress,
        closing(run_sweep(plan, fresh=fresh, stop=interrupt.is_set)) as rows,
    ):
        first = next(rows, None)  # what keeps the sweep from starting is raised here, before anything is printed
        click.echo(csv_line(header(axes, accuracy=plan.asks_accuracy)))
        for row in chain([first] if first else [], rows):
            click.echo(csv_line(cells(row, axes, plan.out, accuracy=plan.asks_accuracy)))
            progress.advance(row)
            findings.add(row)
            if row.state == "failed":
                failed.append(f"{row.output}: {row.error}")
            elif row.kept:
                kept += 1
            else:
                made += 1
                spans = total_spans([spans, row.spans or {}])
    missing = plan.run_count - made - kept - len(failed)
    click.echo(f"{made} made, {kept} kept, {len(failed)} failed, {missing} left; {progress.summary()}", err=True)
    if spans:
        click.echo(_shares(spans), err=True)
    for text in failed[:_MOST_NAMED]:
        click.echo(plain(f"failed: {text}"), err=True)
    if len(failed) > _MOST_NAMED:
        rest = len(failed) - _MOST_NAMED
        click.echo(f"... and {rest} more; `lenscl export {plan.out} --csv` lists all", err=True)
    findings.print()
    with Store.reading(plan.out) as store:
        if left_over := store.left_over():
            click.echo(
                f"{many(left_over, 'image')} of an earlier form of the study stay there; `--fresh` removes them",
                err=True,
            )
    if interrupt.is_set() and missing:
        click.echo("Interrupted. What was made is noted; run the same command again to go on.", err=True)
        raise SystemExit(INTERRUPTED)
    if failed or findings.failed:
        raise SystemExit(SOME_FAILED)
