"""The command that gets one started: new."""
# ruff: noqa: D301 - a backspace, not an escaped one, tells click to leave a paragraph as it is

from __future__ import annotations

import secrets
import shutil
from pathlib import Path

import click

from lenscl.cli.group import plain

_STUDY_NAME = "study.toml"
_PICTURE_SIZE = 512


@click.command()
@click.argument("folder", metavar="DIR", type=click.Path(path_type=Path))
def new(folder: Path) -> None:
    """Make a starter study with pictures.

    The study is commented, and the program draws the pictures itself.

    \b
    Example:
      lenscl new hello
      lenscl sweep hello/study.toml
    """
    from importlib.resources import files

    from lenscl.errors import LensclError
    from lenscl.imaging import SAMPLES, draw, write_image

    text = files("lenscl.cli").joinpath("starter.toml").read_text(encoding="utf-8")
    study = folder / _STUDY_NAME
    # Whatever interrupts this, no half of it stays: all is made in a folder beside or in the one asked for, then moved
    is_there = folder.is_dir()
    half_made = (folder if is_there else folder.parent) / f".lenscl-new-{secrets.token_hex(6)}"
    try:
        if folder.exists() and not folder.is_dir():
            raise LensclError(f"{folder}: is a file; choose another name")
        if folder.is_dir() and any(folder.iterdir()):
            raise LensclError(f"{folder}: is not empty; choose a folder that is, or that does not exist yet")
        (half_made / "pictures").mkdir(parents=True)
        (half_made / _STUDY_NAME).write_text(text, encoding="utf-8")
        for name in SAMPLES:
            write_image(half_made / "pictures" / f"{name}.png", draw(name, _PICTURE_SIZE), metadata={})
        if is_there:
            for name in ("pictures", _STUDY_NAME):
                (half_made / name).rename(folder / name)
        else:
            half_made.rename(folder)
    except OSError as error:
        raise LensclError(f"{folder}: cannot be made: {error.strerror}") from error
    finally:
        shutil.rmtree(half_made, ignore_errors=True)
    click.echo(f"{plain(study)} and {len(SAMPLES)} pictures are made. Next:\n  lenscl sweep {_quoted(study)}")


def _quoted(path: Path) -> str:
    import shlex

    return shlex.quote(str(path))
