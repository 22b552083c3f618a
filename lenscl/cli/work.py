"""The commands that trace: sweep, render, map, and export of what a sweep has noted."""
# ruff: noqa: D301 - a backspace, not an escaped one, tells click to leave a paragraph as it is

from __future__ import annotations

import os
from contextlib import ExitStack, closing
from itertools import chain
from pathlib import Path
from typing import TYPE_CHECKING

import click

from lenscl.cli.group import INTERRUPTED, SOME_FAILED, many, open_study, plain, set_option, study_argument

if TYPE_CHECKING:
    from collections.abc import Mapping

    import numpy as np
    from numpy.typing import NDArray

    from lenscl.config import Study
    from lenscl.status import RayStatus
    from lenscl.sweep import Row, SweepPlan
    from lenscl.tracing import RayMap

_MOST_NAMED = 10  # failures named one by one in a summary


@click.command()
@study_argument
@click.option(
    "-o", "--out", type=click.Path(path_type=Path), metavar="DIR",
    help="Folder for images and table; default out/<study>, below the current folder.",
)  # fmt: skip
@click.option("--dry-run", is_flag=True, help="List points, pictures, outputs and kernels as CSV; make nothing.")
@click.option("--fresh", is_flag=True, help="Remove what earlier runs made in the folder, and start over.")
@set_option
def sweep(study_path: Path, out: Path | None, dry_run: bool, fresh: bool, overrides: tuple[str, ...]) -> None:
    """Paint a folder of pictures through every point of a study.

    Goes on where an earlier run ended, however it ended: only what is missing, failed or changed is made. Rows go to
    standard output as CSV, one for each point and picture, progress and a summary to standard error. A picture or
    point that fails does so alone, and the command then ends with exit code 3.

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
@study_argument
@set_option
@click.option(
    "-i", "--image", type=click.Path(path_type=Path), metavar="IMAGE",
    help="The picture to paint with; default: the study's first.",
)  # fmt: skip
@click.option(
    "-o", "--output", type=click.Path(path_type=Path), metavar="FILE", required=True,
    help="File to write; its ending says the format.",
)  # fmt: skip
def render(study_path: Path, overrides: tuple[str, ...], image: Path | None, output: Path) -> None:
    """Paint one picture as a study's scene shows it, its axes left out.

    \b
    Example:
      lenscl render configs/torus.toml -o torus.png
      lenscl render configs/torus.toml --set lens.r=0.2 -i cat.jpg -o cat.png
    """
    from lenscl.errors import StudyError

    study = open_study(study_path, overrides)
    if image is None and not study.images:
        raise StudyError(["picture.images: the study names no picture; give one with -i IMAGE"])
    _render(study, image or study.images[0], output)


@click.command("map")
@study_argument
@set_option
@click.option(
    "-o", "--output", type=click.Path(path_type=Path), metavar="FILE", required=True,
    help="File to write: .exr (an ST map) or .npz (every array of the ray map).",
)  # fmt: skip
@click.option(
    "--error", "with_error", is_flag=True,
    help="Add a bound on the error of every place: a channel or array called error.",
)  # fmt: skip
def map_(study_path: Path, overrides: tuple[str, ...], output: Path, with_error: bool) -> None:
    """Write where every film pixel looks, without any picture.

    An EXR file is an ST map as compositors read it: red s, green 1 - t, alpha 1 on the picture. An NPZ file holds
    every array of the ray map, and the scene.

    With --error each pixel has a bound on the error of s and t, the larger of the two, against exact physics of the
    scene as written, in picture coordinates; in an EXR what its single precision loses is added. The bound compares:
    every ray is traced again in double precision, and the distance to that is added to what double itself may be off,
    seen from four starts moved by roundings. It is -1 where the ray has no place, or where rounding may decide its
    path. It is not proved but validated: see the README for how often it held.

    \b
    Example:
      lenscl map configs/torus.toml -o torus.exr
      lenscl map configs/torus.toml --set lens.r=0.2 -o torus.npz
      lenscl map configs/torus.toml --set numerics.precision=single --error -o torus.exr
    """
    from lenscl.imaging import write_map
    from lenscl.tracing import trace

    raymap = trace(open_study(study_path, overrides).scene)
    error = None
    if with_error:
        from lenscl.accuracy import error_map

        error = error_map(raymap)
    write_map(output, raymap, error)
    click.echo(plain(f"{output}: {_counted(raymap.counts())}"), err=True)
    _check(raymap)
    if error is not None:
        click.echo(_bounded(raymap, error), err=True)


@click.command()
@click.argument("folder", metavar="OUT", type=click.Path(path_type=Path))
@click.option("--csv", "as_csv", is_flag=True, help="Write CSV, as the sweep printed it.")
@click.option("--parquet", "as_parquet", is_flag=True, help="Not available in this version.")
@click.argument("file", metavar="[FILE]", required=False, type=click.Path(path_type=Path))
def export(folder: Path, as_csv: bool, as_parquet: bool, file: Path | None) -> None:
    """Write the table of a sweep, to FILE or to standard output.

    Rows not made yet have neither output nor error.

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
        lines = csv_lines(store.rows(), store.about("axes"), folder)
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
            kernels[structure] = kernel_source(point.scene).key
        for run in plan.runs_of(point):
            shown = Row(output=run.output, index=run.point, values=run.values, picture=run.picture, state="pending")
            start = cells(shown, axes)[: len(axes) + 2]
            click.echo(csv_line([*start, str(plan.out / run.output), kernels[structure]]))
    click.echo(f"{_size(plan)}; {many(len(set(kernels.values())), 'kernel')}; nothing was made", err=True)
    for picture in plan.pictures:
        if picture.error is not None:
            click.echo(plain(f"unreadable: {picture.error}"), err=True)


def _size(plan: SweepPlan) -> str:
    points, pictures = many(plan.point_count, "point"), many(len(plan.pictures), "picture")
    return plain(f"{points} x {pictures} = {many(plan.run_count, 'image')} in {plan.out}")


def _run(plan: SweepPlan, fresh: bool) -> None:
    from lenscl.cli.interrupt import Interrupt
    from lenscl.cli.progress import Progress
    from lenscl.sweep import Store, cells, csv_line, header, run_sweep

    click.echo(_size(plan), err=True)
    axes = plan.study.axes
    made = kept = 0
    failed: list[str] = []
    checks = _PointChecks()
    with (
        Interrupt() as interrupt,
        Progress(plan.run_count) as progress,
        closing(run_sweep(plan, fresh=fresh, stop=interrupt.is_set)) as rows,
    ):
        first = next(rows, None)  # what keeps the sweep from starting is raised here, before anything is printed
        click.echo(csv_line(header(axes)))
        for row in chain([first] if first else [], rows):
            click.echo(csv_line(cells(row, axes, plan.out)))
            progress.advance(row)
            checks.add(row)
            if row.state == "failed":
                failed.append(f"{row.output}: {row.error}")
            elif row.kept:
                kept += 1
            else:
                made += 1
    missing = plan.run_count - made - kept - len(failed)
    click.echo(f"{made} made, {kept} kept, {len(failed)} failed, {missing} left; {progress.summary()}", err=True)
    for text in failed[:_MOST_NAMED]:
        click.echo(plain(f"failed: {text}"), err=True)
    if len(failed) > _MOST_NAMED:
        rest = len(failed) - _MOST_NAMED
        click.echo(f"... and {rest} more; `lenscl export {plan.out} --csv` lists all", err=True)
    checks.print()
    with Store.reading(plan.out) as store:
        if left_over := store.left_over():
            click.echo(
                f"{many(left_over, 'image')} of an earlier form of the study stay there; `--fresh` removes them",
                err=True,
            )
    if interrupt.is_set() and missing:
        click.echo("Interrupted. What was made is noted; run the same command again to go on.", err=True)
        raise SystemExit(INTERRUPTED)
    if failed:
        raise SystemExit(SOME_FAILED)


class _PointChecks:
    """What the self-checks of a sweep's points found, taken from its rows as they come, point by point."""

    def __init__(self) -> None:
        from lenscl.accuracy import SelfCheck

        self._total, self._made = SelfCheck(), SelfCheck.from_json
        self._point: int | None = None  # whose checks were taken last
        self._warnings: list[str] = []
        self._further = 0

    def add(self, row: Row) -> None:
        """Take those of a row, unless another picture of its point had them."""
        if row.checks is None or row.index == self._point:
            return
        self._point, found = row.index, self._made(row.checks)
        self._total += found
        for text in found.warnings():
            if len(self._warnings) < _MOST_NAMED:
                self._warnings.append(f"warning: point {row.index}, {text}")
            else:
                self._further += 1

    def print(self) -> None:
        """Print one line for all points, and the first warnings."""
        if self._point is None:
            return
        click.echo(plain(self._total.summary()), err=True)
        for text in self._warnings:
            click.echo(plain(text), err=True)
        if self._further:
            click.echo(f"... and {many(self._further, 'more warning')} of self-checks", err=True)


def _counted(counts: Mapping[RayStatus, int]) -> str:
    return ", ".join(f"{count} {status.name.lower().replace('_', ' ')}" for status, count in counts.items() if count)


def _bounded(raymap: RayMap, error: NDArray[np.float64]) -> str:
    """Say how large the error bounds are, and how many pixels have none, and why."""
    import numpy as np

    from lenscl.status import RayStatus

    some = error[error >= 0]
    lands = np.isin(raymap.status, [status for status in RayStatus if status.lands])
    parts = [f"{some.size} of {error.size} pixels have an error bound"]
    if some.size:
        quantiles = np.quantile(some, (0.5, 0.99, 1.0))
        largest_side = max(raymap.scene.picture.size)
        for unit, size in (("px of the picture", largest_side), ("in coordinates", 1)):
            median, high, largest = quantiles * size
            parts.append(f"median {median:.2g}, 99 % {high:.2g}, largest {largest:.2g} {unit}")
    if homeless := int((~lands).sum()):
        parts.append(f"{homeless} have none as they land nowhere")
    if unsure := int((lands & (error < 0)).sum()):
        parts.append(f"{unsure} have none as rounding may decide their path")
    return "; ".join(parts)


def _render(study: Study, image: Path, output: Path) -> None:
    from lenscl.imaging import Painter, read_picture, write_image
    from lenscl.sweep import paint_as_told
    from lenscl.tracing import trace
    from lenscl.version import program_version

    picture = read_picture(image)
    raymap = trace(study.scene)
    painted, encoding = paint_as_told(Painter(raymap), picture, study.scene, output.suffix.lower()[1:])
    metadata = {
        "program": program_version(),
        "title": study.title,
        "picture": os.fsencode(image.name).decode("utf-8", "backslashreplace"),
        "scene": study.scene.to_toml(),
    }
    write_image(output, painted, metadata=metadata, encoding=encoding)
    click.echo(plain(f"{output}: {_counted(raymap.counts())}"), err=True)
    _check(raymap)


def _check(raymap: RayMap) -> None:
    """Print what the map's self-checks found; the result stands, whatever they find."""
    from lenscl.accuracy import SelfCheck, check_map
    from lenscl.errors import LensclError

    try:
        checks = check_map(raymap)
    except LensclError as error:
        checks = SelfCheck(error=" ".join(str(error).split()))
    click.echo(plain(checks.summary()), err=True)
    for text in checks.warnings():
        click.echo(plain(f"warning: {text}"), err=True)
