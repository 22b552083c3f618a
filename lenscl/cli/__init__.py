"""The command line: parse, call, print. Rows and tables go to standard output, progress and messages to standard error.

Nothing heavy is imported here: every command imports what it needs when it runs, so that `lenscl --help` is quick.
Exit codes: 0 done; 1 error; 2 the request or the study is wrong; 3 finished, but some of the work or of the self-checks
failed; 4 no usable OpenCL device; 130 interrupted.
"""
# ruff: noqa: D301 - a backspace, not an escaped one, tells click to leave a paragraph as it is

from __future__ import annotations

import os
import sys
from contextlib import suppress

import click

from lenscl.cli.bench import bench
from lenscl.cli.explain import explain
from lenscl.cli.group import Group
from lenscl.cli.hardcases import hardcases
from lenscl.cli.look import check, kernel, schema
from lenscl.cli.machine import devices, doctor, lenses
from lenscl.cli.pareto import pareto
from lenscl.cli.scene import map_, render
from lenscl.cli.start import new
from lenscl.cli.sweep import export, sweep

__all__ = ["main"]


def _print_version(ctx: click.Context, _: click.Parameter, is_wanted: bool) -> None:
    if is_wanted and not ctx.resilient_parsing:
        click.echo(f"lenscl {_version()}")
        ctx.exit()


def _version() -> str:
    """Return the installed version, from the name of the folder that pip keeps about it.

    `importlib.metadata` reads the same name, after 100 ms of imports; it is asked where there is no such folder.
    """
    for folder in sys.path:
        with suppress(OSError):
            for name in os.listdir(folder or "."):
                if name.startswith("lenscl-") and name.endswith(".dist-info"):
                    return name.removeprefix("lenscl-").removesuffix(".dist-info")
    from importlib.metadata import version

    return version("lenscl")


@click.group(cls=Group, context_settings={"help_option_names": ["-h", "--help"], "max_content_width": 100})
@click.option(
    "--version", is_flag=True, is_eager=True, expose_value=False, callback=_print_version, help="Print the version."
)
def main() -> None:
    """Look at pictures through lenses of any shape.

    A study is one TOML file: a source of light, a film, lenses, a picture, and the values that vary.

    \b
    Example:
      lenscl new hello
      lenscl sweep hello/study.toml
    """


_WORK, _LOOK = (new, render, sweep, export, map_), (check, explain, kernel, lenses, devices, doctor, schema)
for _command in (*_WORK, *_LOOK, pareto, hardcases, bench):
    main.add_command(_command)
