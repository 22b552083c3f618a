"""The commands that look at a study and change nothing: check, kernel, schema."""
# ruff: noqa: D301 - a backspace, not an escaped one, tells click to leave a paragraph as it is

from __future__ import annotations

import glob
import json
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from lenscl.cli.group import SOME_FAILED, json_option, many, open_study, plain, set_option, study_argument

if TYPE_CHECKING:
    from lenscl.config import Scene, Study

_MOST_POINTS_LISTED = 20  # in text; --json lists all
_MOST_NUMBERS = 8  # of points that share a hard spot


@click.command()
@study_argument
@set_option
@json_option
def check(study_path: Path, overrides: tuple[str, ...], as_json: bool) -> None:
    """Validate a study and find the hard spots of its scenes.

    The command lists points, pictures and hard spots. Nothing is traced: hard spots are found from boxes, planes, the
    source and bounds of F. Hard spots are singular points and kinks in view of the film, parts thinner than a film
    pixel, expressions that are empty, undefined or not differentiable or that have a pole, and solids that are not
    proved apart. For such solids the command says how they lie and which of them is the medium.

    Hard spots are no faults, and neither are remarks on non-square pixels. Faults are pictures that cannot be read or
    written in the study's format, patterns that match no file, and an unreadable environment; the exit code is then
    3.

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
    shown = [*found["pictures"], *([found["environment"]] if found["environment"] else [])]
    if found["unmatched"] or any(picture["error"] for picture in shown):
        raise SystemExit(SOME_FAILED)


@click.command()
@study_argument
@set_option
def kernel(study_path: Path, overrides: tuple[str, ...]) -> None:
    """Print the generated OpenCL C of a study's scene.

    The kernel is that for the device which would be chosen.

    \b
    Example:
      lenscl kernel configs/torus.toml
      lenscl kernel configs/torus.toml --set numerics.precision=single > torus.cl
    """
    from lenscl.accuracy import largest_size, planner_of
    from lenscl.tracing import kernel_source

    study = open_study(study_path, overrides)
    scene = study.scene
    if scene.numerics.accuracy is not None:
        plan = planner_of().plan(scene, largest_size(scene, study.images))
        click.echo(plain(f"accuracy: {plan.achieved}"), err=True)
        scene = plan.combination.of(scene)
    click.echo(kernel_source(scene).text)


@click.command()
def schema() -> None:
    """Print the JSON schema of a study.

    Editors use it to complete and check the keys of a study.

    \b
    Example:
      lenscl schema > study.schema.json
    """
    from lenscl.config import study_schema

    click.echo(json.dumps(study_schema(), indent=2))


def _examine(study: Study) -> dict[str, Any]:
    from lenscl.sweep import shown_scenes, stretch_notes, study_hard_spots

    spots, looked_at = study_hard_spots(study)
    return {
        "title": study.title,
        "axes": list(study.axes),
        "points": study.point_count(),
        "pictures": [_try_picture(path, study.output.format) for path in study.images],
        "environment": _try_environment(study.scene),
        "unmatched": [text for text in _patterns(study) if not _matches(text, study.folder)],
        "points_looked_at": looked_at,
        "remarks": stretch_notes(shown_scenes(study), study.images),
        "hard_spots": [
            {"key": spot.key, "kind": spot.kind, "message": spot.message, "points": list(spot.points)} for spot in spots
        ],
    }


def _patterns(study: Study) -> list[str]:
    images = study.scene.picture.images
    return [images] if isinstance(images, str) else list(images or ())


def _matches(pattern: str, folder: Path) -> bool:
    """Whether a pattern names any file; a name that is no pattern is tried as a picture instead."""
    return not glob.has_magic(pattern) or next(glob.iglob(pattern, root_dir=folder), None) is not None


def _try_picture(path: Path, image_format: str) -> dict[str, Any]:
    from lenscl.errors import ImageError
    from lenscl.imaging import read_picture
    from lenscl.sweep import refused_format

    try:
        picture = read_picture(path)
    except ImageError as error:
        return {"path": str(path), "size": None, "channels": None, "error": " ".join(str(error).split())}
    channels, error_text = picture.pixels.shape[2], refused_format(picture, image_format)
    return {"path": str(path), "size": list(picture.size), "channels": channels, "error": error_text}


def _try_environment(scene: Scene) -> dict[str, Any] | None:
    """Return what is found of the image that lenses reflect; None where they reflect none."""
    from lenscl.errors import ImageError
    from lenscl.imaging import read_picture

    shown = scene.environment
    if scene.effects["fresnel"] != "split" or not isinstance(shown, str) or shown == "picture":
        return None
    try:
        return {"path": shown, "size": list(read_picture(shown).size), "error": None}
    except ImageError as error:
        return {"path": shown, "size": None, "error": " ".join(str(error).split())}


def _print_findings(study: Study, found: dict[str, Any]) -> None:
    """Print what was found, for people."""
    pictures, spots, points = found["pictures"], found["hard_spots"], found["points"]
    click.echo(f"{plain(study.title or 'study')}: valid; {many(points, 'point')}, {many(len(pictures), 'picture')}")

    click.echo(f"\nPoints: {', '.join(study.axes) or 'no axes, the scene itself'}")
    for point in study.points():
        if point.index >= _MOST_POINTS_LISTED:
            click.echo(f"  ... and {points - _MOST_POINTS_LISTED} more; `lenscl sweep --dry-run` lists all")
            break
        values = ", ".join(f"{key} = {json.dumps(value)}" for key, value in point.values.items())
        click.echo(f"  {point.index}  {values}".rstrip())

    is_listed = pictures or found["unmatched"]
    click.echo(
        "\nPictures:" if is_listed else "\nPictures: none; `lenscl map` needs none, `lenscl render` takes one with -i"
    )
    for pattern in found["unmatched"]:
        where = plain(f"{json.dumps(pattern, ensure_ascii=False)} in {study.folder}")
        click.echo(f"  picture.images: no file matches {where}; see that the folder is there and can be read")
    for picture in pictures:
        size = picture["size"]
        what = f"{size[0]} x {size[1]}, {many(picture['channels'], 'channel')}" if size else "UNREADABLE"
        error = f": {picture['error']}" if picture["error"] else ""
        click.echo(plain(f"  {picture['path']}  {what}{error}"))
    if around := found["environment"]:
        what = around["error"] or "{} x {}".format(*around["size"])
        click.echo(plain(f"  effects.environment: {around['path']}  {'UNREADABLE: ' if around['error'] else ''}{what}"))

    click.echo("\nHard spots:" if spots else "\nHard spots: none found")
    for spot in spots:
        click.echo(f"  {spot['key']}: {spot['message']}{_where(spot['points'], found['points_looked_at'])}")
    if found["points_looked_at"] < points:
        click.echo(f"  (looked at {found['points_looked_at']} of {points} points)")
    if found["remarks"]:
        click.echo("\nRemarks:")
    for remark in found["remarks"]:
        click.echo(plain(f"  {remark}"))


def _where(points: list[int], looked_at: int) -> str:
    if len(points) == looked_at:
        return ""
    shown = ", ".join(str(index) for index in points[:_MOST_NUMBERS])
    return f" (point {shown}{', ...' if len(points) > _MOST_NUMBERS else ''}; {len(points)} of {looked_at})"
