from __future__ import annotations

import re
import shlex
import subprocess
import sys

import click
import pytest
from click.testing import CliRunner
from patience import PATIENCE

from lenscl.cli import main

COMMANDS = sorted(main.commands)
EXPECTED = "bench check devices doctor explain export hardcases kernel lenses map new pareto render schema sweep"


def test_the_commands_are_those_of_this_version() -> None:
    assert EXPECTED.split() == COMMANDS


def examples(command: click.Command) -> list[str]:
    """Return the lines of the Example block."""
    text = command.help or ""
    block = re.search(r"\x08\n\s*Example:\n((?:\s+.+\n?)+)", text)
    return [line.strip() for line in block[1].splitlines() if line.strip()] if block else []


@pytest.mark.parametrize("name", COMMANDS)
def test_a_command_has_help_an_example_and_a_line_for_every_option(name: str) -> None:
    command = main.commands[name]
    assert len((command.help or "").split()) > 8
    assert examples(command)
    for parameter in command.params:
        if isinstance(parameter, click.Option):
            assert parameter.help, f"{name} {parameter.opts} has no help"


@pytest.mark.parametrize(("name", "line"), [(n, line) for n in [*COMMANDS] for line in examples(main.commands[n])])
def test_an_example_is_a_command_line_that_is_understood(name: str, line: str) -> None:
    words = shlex.split(line.split(" > ")[0])
    words = [word for word in words if not re.fullmatch(r"[A-Z_]+=.*", word) or word.startswith("-")]
    assert words[0] == "lenscl"
    command = main.commands[words[1]]
    context = command.make_context(words[1], words[2:])  # raises for an option or argument that does not exist
    assert context.params or not command.params


def test_the_list_of_commands_has_whole_sentences(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("COLUMNS", "80")
    listed = CliRunner().invoke(main, ["--help"]).stdout.split("Commands:")[1].splitlines()
    rows = [line.split(maxsplit=1) for line in listed if line.strip()]
    assert sorted(name for name, _ in rows) == COMMANDS
    assert all(sentence.endswith(".") and not sentence.endswith("...") for _, sentence in rows)


def test_a_command_without_an_example_would_be_noticed() -> None:
    assert examples(click.Command("bare", help="Do this and that.\n\nExample of nothing.")) == []


def test_help_and_version_import_nothing_heavy() -> None:
    probe = (
        "import sys, lenscl.cli\n"
        "try: lenscl.cli.main([sys.argv[1]])\n"
        "except SystemExit: pass\n"
        "print(' '.join(sys.modules), file=sys.stderr)"
    )
    heavy = ("numpy", "pyopencl", "OpenImageIO", "pydantic", "rich", "sqlite3", "lenscl.config", "lenscl.sweep")
    for flag in ("--help", "--version"):
        done = subprocess.run([sys.executable, "-c", probe, flag], capture_output=True, text=True, timeout=PATIENCE)
        loaded = done.stderr.split()
        assert "lenscl.cli.sweep" in loaded
        assert [name for name in heavy if name in loaded] == []


def test_the_version_is_the_installed_one(lenscl) -> None:
    from importlib.metadata import version

    assert lenscl("--version").output == f"lenscl {version('lenscl')}\n"


def test_an_unknown_command_or_option_is_a_usage_error(lenscl) -> None:
    assert lenscl("swep").exit_code == 2
    assert lenscl("sweep", "--nonsense").exit_code == 2
