"""What all commands share: the one place where errors become messages and exit codes, and common options."""

from __future__ import annotations

import errno
import os
import sys
from collections.abc import Callable, Iterable, Sequence
from contextlib import suppress
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar

import click

from lenscl.errors import LensclError, StudyError

if TYPE_CHECKING:
    from lenscl.config import Scene, Study

INTERRUPTED = 130
SOME_FAILED = 3

_Command = TypeVar("_Command", bound=Callable[..., Any])


class Group(click.Group):
    """A group whose commands may raise `LensclError`; commands are listed as they were added."""

    def list_commands(self, ctx: click.Context) -> list[str]:
        """Return the commands in the order of a user's way through the program."""
        return list(self.commands)

    def invoke(self, ctx: click.Context) -> Any:
        """Run a command; turn what it raises into a message and an exit code, but leave a bug its traceback."""
        try:
            return super().invoke(ctx)
        except LensclError as error:
            for problem in error.problems if isinstance(error, StudyError) else (str(error),):
                _complain(problem)
            ctx.exit(error.exit_code)
        except KeyboardInterrupt:
            click.echo("Interrupted.", err=True)
            ctx.exit(INTERRUPTED)
        except OSError as error:
            if error.errno != errno.EPIPE:  # the reader of our rows has seen enough: `lenscl ... | head`
                _complain(_explained(error))
            _discard_output()
            ctx.exit(1)
        except MemoryError as error:
            _complain(f"out of memory ({str(error) or 'no more is given'}); film.size or the picture may be too large")
            ctx.exit(1)


def study_argument(command: _Command) -> _Command:
    """Add the argument STUDY.toml, as `study_path`."""
    argument = click.argument("study_path", metavar="STUDY.toml", type=click.Path(path_type=Path))
    return argument(command)


def set_option(command: _Command) -> _Command:
    """Add the repeatable option --set KEY=VALUE, as `overrides`."""
    option = click.option(
        "--set",
        "overrides",
        metavar="KEY=VALUE",
        multiple=True,
        help="Set a key of the study, as in lens.r=0.2. The value is TOML; bare text is a string. Repeatable.",
    )
    return option(command)


def json_option(command: _Command) -> _Command:
    """Add the flag --json, as `as_json`."""
    return click.option("--json", "as_json", is_flag=True, help="Print JSON, for programs.")(command)


def open_study(path: Path, overrides: Sequence[str]) -> Study:
    """Load a study with what --set changes in it."""
    from lenscl.config import load_study, parse_override

    # What --set changes is judged as it is set: the file's own value may be wrong, missing or need what is not here
    changes = dict(parse_override(text) for text in overrides)
    return load_study(path, changes) if changes else load_study(path)


def tell_stretched(scenes: Iterable[Scene], images: Iterable[Path]) -> None:
    """Note on standard error where a film or a picture shows things longer one way than the other."""
    from lenscl.sweep import stretch_notes

    for text in stretch_notes(scenes, images):
        click.echo(plain(f"note: {text}"), err=True)


def many(count: int, noun: str) -> str:
    """Return a count with its noun: "1 point", "2 points"."""
    return f"{count} {noun}{'' if count == 1 else 's'}"


def plain(text: object) -> str:
    """Return text for people to read: nothing in it moves a cursor, turns the writing round or breaks the line."""
    return "".join(c if c.isprintable() else c.encode("unicode_escape").decode() for c in str(text))


def _complain(text: str) -> None:
    with suppress(OSError):  # standard error may be what cannot be written
        click.echo("Error: " + "\n".join(plain(line) for line in text.split("\n")), err=True)


def _explained(error: OSError) -> str:
    """Return what is wrong, led by the file where one is known."""
    try:
        os.getcwd()
    except OSError:
        return "the current folder is gone; change to another"
    where = "" if error.filename is None else f"{error.filename}: "
    return f"{where}{error.strerror or error}; see to its permissions and to room on the disk, then run this again"


def _discard_output() -> None:
    """Let the interpreter flush what is still buffered into nothing, rather than complain on its way out."""
    with suppress(OSError, ValueError):  # standard output may be closed, or no file at all
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
