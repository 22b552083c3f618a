"""The commands that look at a study and change nothing: check, kernel, schema."""
# ruff: noqa: D301 - a backspace, not an escaped one, tells click to leave a paragraph as it is

from __future__ import annotations

import json
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from lenscl.cli.group import SOME_FAILED, json_option, many, open_study, set_option, study_argument

if TYPE_CHECKING:
    from lenscl.config import Study

_MOST_POINTS_LISTED = 20  # in text; --json lists all
_MOST_NUMBERS = 8  # of points that share a hard spot


@click.command()
@study_argument
@set_option
@json_option
def check(study_path: Path, overrides: tuple[str, ...], as_json: bool) -> None:
    """Validate a study; list its points, its pictures and what is hard about its scenes.

    Hard spots are found from boxes, planes and the source alone; nothing is traced. They are reasons to look twice,
    not faults. A picture that cannot be read is a fault: exit code 3.

    \b
    Example:
      lenscl check configs/torus.toml
      lenscl check configs/torus.toml --set lens.r=0.6 --json
    """
    study = open_study(study_path, overrides)
    found = _examine(study)
    if as_json:
        click.echo(json.dumps(found, indent=2))
    else:
        _print_findings(study, found)
    if any(picture["error"] for picture in found["pictures"]):
        raise SystemExit(SOME_FAILED)


@click.command()
@study_argument
@set_option
def kernel(study_path: Path, overrides: tuple[str, ...]) -> None:
    """Print the generated OpenCL C that traces a study's scene on the device that would be chosen.

    \b
    Example:
      lenscl kernel configs/torus.toml
      lenscl kernel configs/torus.toml --set numerics.precision=single > torus.cl
    """
    from lenscl.tracing import kernel_source

    click.echo(kernel_source(open_study(study_path, overrides).scene).text)


@click.command()
def schema() -> None:
    """Print the JSON schema of a study, for editors that complete and check TOML.

    \b
    Example:
      lenscl schema > study.schema.json
    """
    from lenscl.config import study_schema

    click.echo(json.dumps(study_schema(), indent=2))


def _examine(study: Study) -> dict[str, Any]:
    from lenscl.sweep import study_hard_spots

    spots, looked_at = study_hard_spots(study)
    return {
        "title": study.title,
        "axes": list(study.axes),
        "points": study.point_count(),
        "pictures": [_try_picture(path) for path in study.images],
        "points_looked_at": looked_at,
        "hard_spots": [
            {"key": spot.key, "kind": spot.kind, "message": spot.message, "points": list(spot.points)} for spot in spots
        ],
    }


def _try_picture(path: Path) -> dict[str, Any]:
    from lenscl.errors import ImageError
    from lenscl.imaging import read_picture

    try:
        rows, columns, channels = read_picture(path).pixels.shape
    except ImageError as error:
        return {"path": str(path), "size": None, "channels": None, "error": " ".join(str(error).split())}
    return {"path": str(path), "size": [columns, rows], "channels": channels, "error": None}


def _print_findings(study: Study, found: dict[str, Any]) -> None:
    """Print what was found, for people."""
    pictures, spots, points = found["pictures"], found["hard_spots"], found["points"]
    click.echo(f"{study.title or 'study'}: valid; {many(points, 'point')}, {many(len(pictures), 'picture')}")

    click.echo(f"\nPoints: {', '.join(study.axes) or 'no axes, the scene itself'}")
    for point in study.points():
        if point.index >= _MOST_POINTS_LISTED:
            click.echo(f"  ... and {points - _MOST_POINTS_LISTED} more; `lenscl sweep --dry-run` lists all")
            break
        values = ", ".join(f"{key} = {json.dumps(value)}" for key, value in point.values.items())
        click.echo(f"  {point.index}  {values}".rstrip())

    click.echo(
        "\nPictures:" if pictures else "\nPictures: none; `lenscl map` needs none, `lenscl render` takes one with -i"
    )
    for picture in pictures:
        size = picture["size"]
        what = (
            f"{size[0]} x {size[1]}, {many(picture['channels'], 'channel')}"
            if size
            else f"UNREADABLE: {picture['error']}"
        )
        click.echo(f"  {picture['path']}  {what}")

    click.echo("\nHard spots:" if spots else "\nHard spots: none found")
    for spot in spots:
        click.echo(f"  {spot['key']}: {spot['message']}{_where(spot['points'], found['points_looked_at'])}")
    if found["points_looked_at"] < points:
        click.echo(f"  (looked at {found['points_looked_at']} of {points} points)")


def _where(points: list[int], looked_at: int) -> str:
    if len(points) == looked_at:
        return ""
    shown = ", ".join(str(index) for index in points[:_MOST_NUMBERS])
    return f" (point {shown}{', ...' if len(points) > _MOST_NUMBERS else ''}; {len(points)} of {looked_at})"
