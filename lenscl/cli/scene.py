"""The commands that trace one scene: render and map."""
# ruff: noqa: D301 - a backspace, not an escaped one, tells click to leave a paragraph as it is

from __future__ import annotations

import os
from pathlib import Path
from typing import TYPE_CHECKING

import click

from lenscl.cli.group import SOME_FAILED, open_study, plain, set_option, study_argument, tell_stretched

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping

    import numpy as np
    from numpy.typing import NDArray

    from lenscl.accuracy import Achieved
    from lenscl.config import Study
    from lenscl.status import RayStatus
    from lenscl.tracing import Caustic, RayMap

_AS_FLOAT32 = "; all are those of the file, whose float32 numbers lose more than the map's"


@click.command()
@study_argument
@set_option
@click.option(
    "-i", "--image", type=click.Path(path_type=Path), metavar="IMAGE",
    help="Picture to paint; default: the first one of the study.",
)  # fmt: skip
@click.option(
    "-o", "--output", type=click.Path(path_type=Path), metavar="FILE", required=True,
    help="File to write; its suffix selects the format.",
)  # fmt: skip
def render(study_path: Path, overrides: tuple[str, ...], image: Path | None, output: Path) -> None:
    """Paint one picture through the scene of a study.

    The scene has the values of the study's own tables; sweep axes are ignored. With effects.caustics the result is
    the picture itself, of the size picture.size, in the light that the source sends there through the lenses.

    A sample of the rays is tested against laws that every path obeys. If some rays fail, the file is still written,
    standard error names them and the reason, and the exit code is 3.

    \b
    Example:
      lenscl render configs/torus.toml -o torus.png
      lenscl render configs/torus.toml --set lens.r=0.2 -i cat.jpg -o cat.png
      lenscl render configs/torus.toml --set effects.antialias=edges -o smooth.png
    """
    from lenscl.errors import StudyError

    study = open_study(study_path, overrides)
    if image is None and not study.images:
        raise StudyError(["picture.images: the study names no picture; give one with -i IMAGE"])
    if _render(study, image or study.images[0], output):
        raise SystemExit(SOME_FAILED)


@click.command("map")
@study_argument
@set_option
@click.option(
    "-o", "--output", type=click.Path(path_type=Path), metavar="FILE", required=True,
    help="File to write: .exr (an ST map) or .npz (every array of the ray map).",
)  # fmt: skip
@click.option(
    "--error", "with_error", is_flag=True,
    help="Add a bound on the error of every pixel, as a channel or array called error.",
)  # fmt: skip
def map_(study_path: Path, overrides: tuple[str, ...], output: Path, with_error: bool) -> None:
    """Write the ray map: where each film pixel lands.

    An EXR file is an ST map for compositors: red is s, green is 1 - t, alpha is 1 on the picture. An NPZ file holds
    every array of the ray map and the scene. Wavelengths of effects.dispersion, samples of effects.antialias, and the
    irradiance of effects.caustics are in NPZ files only.

    With --error each pixel has a bound on the error of s and t, the larger of the two, against exact physics of the
    scene as written, in picture coordinates. The bound adds the distance to the same ray in double precision, and all
    rounding errors of double precision on that path; in an EXR file, also the rounding of the file's single
    precision. The bound is -1 where the ray has no place, where rounding may decide its path, or where a first-order
    bound is too large. It is validated, not proved.

    A sample of the rays is tested against laws that every path obeys. If some rays fail, the file is still written,
    standard error names them and the reason, and the exit code is 3.

    \b
    Example:
      lenscl map configs/torus.toml -o torus.exr
      lenscl map configs/torus.toml --set lens.r=0.2 -o torus.npz
      lenscl map configs/torus.toml --set numerics.precision=single --error -o torus.exr
    """
    from lenscl.imaging import error_in_file, refuse_wavelengths, write_map

    study = open_study(study_path, overrides)
    refuse_wavelengths(output, study.scene.wavelengths)
    raymap, achieved = _trace(study, study.images)
    error = None
    if with_error:
        from lenscl.accuracy import error_map, largest_size

        error = error_map(raymap)
    write_map(output, raymap, error)
    if output.suffix.lower() == ".exr" and (raymap.samples is not None or raymap.caustic is not None):
        click.echo("note: an .exr holds neither samples nor irradiance; write an .npz for those", err=True)
    has_failed = _report(output, raymap, achieved)
    if error is not None:
        stored, pixels = error_in_file(output, raymap, error), max(largest_size(study.scene, study.images))
        is_st_map = output.suffix.lower() == ".exr"
        click.echo(_bounded(raymap, stored, pixels) + (_AS_FLOAT32 if is_st_map else ""), err=True)
    tell_stretched([study.scene], ())
    if has_failed:
        raise SystemExit(SOME_FAILED)


def _counted(counts: Mapping[RayStatus, int]) -> str:
    return ", ".join(f"{count} {status.name.lower().replace('_', ' ')}" for status, count in counts.items() if count)


def _part(name: str, part: float) -> str:
    return f"{100 * part:.3g} % {name}"


def _not_excluded(caustic: Caustic) -> str:
    """Return what the account of light may be off by, in words."""
    at_edges = caustic.not_excluded - caustic.bent
    said = f"not excluded: at most {100 * at_edges:.2g} % of the light, at outlines, edges and folds, ends elsewhere"
    if caustic.bent > 0:
        said += (
            f"; nor for {100 * caustic.bent:.2g} %, which a lens has bent, that it meets details of lenses finer than "
            "the rays that look for them"
        )
    return said


def _bounded(raymap: RayMap, error: NDArray[np.float64], pixels: int) -> str:
    """Say how large the error bounds are on a picture of so many pixels, and how many have none, and why."""
    import numpy as np

    from lenscl.status import RayStatus

    some = error[error >= 0]
    lands = np.isin(raymap.status, [status for status in RayStatus if status.lands])
    parts = [f"error bounds: {some.size} of {error.size} pixels have one"]
    if some.size:
        quantiles = np.quantile(some, (0.5, 0.99, 1.0))
        for unit, size in (("px of the picture", pixels), ("in coordinates", 1)):
            median, high, largest = quantiles * size
            parts.append(f"median {median:.2g}, 99 % {high:.2g}, largest {largest:.2g} {unit}")
    if homeless := int((~lands).sum()):
        parts.append(f"{homeless} have none as they land nowhere")
    if unsure := int((lands & (error < 0)).sum()):
        parts.append(f"{unsure} have none as rounding may decide their path, or is too large to be counted")
    return "; ".join(parts)


def _render(study: Study, image: Path, output: Path) -> bool:
    """Paint an image and report on it; return whether some self-checks failed."""
    from lenscl.imaging import painter_of, read_picture, refuse_unseen, write_image
    from lenscl.sweep import paint_as_told
    from lenscl.version import program_version

    refuse_unseen(study.scene.wavelengths)
    picture = read_picture(image)
    raymap, achieved = _trace(study, [*study.images, image])
    painted, encoding = paint_as_told(painter_of(raymap), picture, study.scene, output.suffix.lower()[1:])
    metadata = {
        "program": program_version(),
        "title": study.title,
        "picture": os.fsencode(image.name).decode("utf-8", "backslashreplace"),
        "scene": study.scene.to_toml(),
    }
    write_image(output, painted, metadata=metadata, encoding=encoding)
    has_failed = _report(output, raymap, achieved)
    tell_stretched([study.scene], [image])
    return has_failed


def _trace(study: Study, images: Iterable[Path]) -> tuple[RayMap, Achieved | None]:
    """Trace a study's scene as it asks, pixels being those of the largest of some images."""
    from lenscl.accuracy import largest_size, planner_of

    return planner_of().trace(study.scene, size=largest_size(study.scene, images))


def _report(output: Path, raymap: RayMap, achieved: Achieved | None) -> bool:
    """Print how the rays ended, how accurate they are where that was asked, and what the map's self-checks found.

    The result stands, whatever they find. Returns whether some failed.
    """
    from lenscl.accuracy import SelfCheck, check_map
    from lenscl.errors import LensclError

    click.echo(plain(f"{output}: {_counted(raymap.counts())}"), err=True)
    if (samples := raymap.samples) is not None:
        pixels, side = len(samples.pixels), samples.side
        rows, columns = raymap.status.shape[-2:]
        some = f"{pixels:,} of {rows * columns:,} pixels have {side} x {side} rays more"
        click.echo(f"antialias: {some}, {samples.status.size:,} together", err=True)
    if (caustic := raymap.caustic) is not None:
        shares = ((name.replace("_", " "), share) for name, share in caustic.shares.items())
        click.echo("caustics: of the light, " + ", ".join(_part(*each) for each in shares if each[1] > 0), err=True)
        click.echo("caustics: " + _not_excluded(caustic), err=True)
    if achieved is not None:
        click.echo(plain(f"accuracy: {achieved}, against {achieved.against}"), err=True)
    try:
        checks = check_map(raymap)
    except LensclError as error:
        checks = SelfCheck(error=" ".join(str(error).split()))
    click.echo(plain(checks.summary()), err=True)
    for text in checks.warnings():
        click.echo(plain(f"warning: {text}"), err=True)
    return checks.failed > 0
