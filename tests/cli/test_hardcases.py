from __future__ import annotations

import json
import os
import re
import subprocess
import sys

import pytest
from click.testing import CliRunner

from lenscl.cli import main
from lenscl.cli.hardcases import _METHODS, _PRECISIONS
from lenscl.hardcases import most_undecided
from lenscl.methods import METHODS


def run(*arguments: str) -> tuple[int, str, str]:
    result = CliRunner().invoke(main, ["hardcases", *arguments])
    return result.exit_code, result.stdout, result.stderr


def test_the_table_has_a_row_a_family_and_what_they_come_to() -> None:
    code, out, err = run("--case", "refused", "--case", "exact lens")
    assert code == 0
    assert err.splitlines() == ["1 of 19 cases: refused", "16 of 19 cases: exact lens"]
    rows = [line.split("  ")[0] for line in out.splitlines()]
    assert rows[:4] == ["family", "refused", "exact lens", "all"]
    assert out.splitlines()[-1].endswith("method auto, precision double")


def test_editions_stand_apart_and_every_undecided_ray_has_its_reason() -> None:
    code, out, err = run("--case", "screens: a film through", "--case", "opaque: a film before a torus of 1.5")
    assert code == 0, err
    head, *rows = (re.split(r"  +", line.strip()) for line in out.splitlines()[:6])
    assert [row[0] for row in rows] == ["screens", "edition 1", "opaque lens", "edition 2", "all"]
    numbers = [(k, name) for k, name in enumerate(head) if name not in ("family", "worst error")]
    column = {name: [int(row[k]) for row in rows] for k, name in numbers}
    for name in ("rays", "decided", "undecided", "wrong"):
        screens, first, opaque, second, both = column[name]
        assert (first, second, both) == (screens, opaque, screens + opaque), name
    assert column["rays"] == [25, 25, 49, 49, 74]
    assert [sum(pair) for pair in zip(column["decided"], column["undecided"], strict=True)] == column["rays"]
    assert column["undecided"][-1] == 1
    reasons = [re.split(r"  +", line.strip()) for line in out.splitlines()[7:10]]
    assert reasons == [["family", "why undecided", "rays"], ["screens", "screen", "1"], ["all", "screen", "1"]]


@pytest.mark.parametrize(
    ("method", "precision", "less", "expected"),
    [("auto", "double", 1, 3), ("auto", "double", 0, 0), ("guarded", "double", 1, 0), ("auto", "mixed", 1, 0)],
)
def test_more_undecided_than_expected_of_the_method_is_named_and_the_exit_code_tells(
    method: str, precision: str, less: int, expected: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    most = most_undecided()
    most["double"]["auto"]["screens"] -= less
    monkeypatch.setattr("lenscl.hardcases.pack.most_undecided", lambda: most)
    arguments = ("--method", method, "--precision", precision, "--case", "screens: a film through")
    code, out, err = run(*arguments)
    said = "too many undecided: screens: 1 ray, where at most 0 are expected"
    assert (code, said in err) == (expected, expected == 3)
    at_most = 0 if expected else 1
    assert out.splitlines()[1].split()[-3:] == ["1", str(at_most), "0"]
    code, out, _ = run(*arguments, "--json")
    family = json.loads(out)["families"][0]
    assert code == expected
    assert (family["undecided"], family["most_undecided"], family["reasons"]) == (1, at_most, {"screen": 1})


@pytest.mark.parametrize("method", ["march", "auto"])
def test_nothing_is_expected_of_a_method_without_a_table(method: str, monkeypatch: pytest.MonkeyPatch) -> None:
    most = most_undecided()
    most["double"].pop(method, None)
    monkeypatch.setattr("lenscl.hardcases.pack.most_undecided", lambda: most)
    arguments = ("--method", method, "--case", "screens: a film through")
    code, out, err = run(*arguments)
    assert "too many" not in err
    head, row = out.splitlines()[:2]
    assert row[head.index("undecided") : head.index("wrong")].split() == ["1"]  # under "at most" it is empty
    again, out, _ = run(*arguments, "--json")
    assert code == again == 0
    assert json.loads(out)["families"][0]["most_undecided"] is None


def test_json_stands_alone_on_standard_output() -> None:
    code, out, err = run("--case", "refused", "--json")
    assert code == 0
    assert len(json.loads(out)["cases"]) == 15
    assert err.splitlines() == ["1 of 15 cases: refused"]


@pytest.mark.skipif(sys.platform == "win32", reason="needs a pseudo-terminal")
def test_a_terminal_is_shown_a_bar_and_the_table_is_free_of_it() -> None:
    ours, theirs = os.openpty()
    line = [sys.executable, "-m", "lenscl", "hardcases", "--case", "refused: a"]
    with subprocess.Popen(line, stdout=subprocess.PIPE, stderr=theirs, text=True) as child:
        os.close(theirs)
        shown = b""
        while piece := _read(ours):
            shown += piece
        assert child.stdout is not None
        table = child.stdout.read()
    os.close(ours)
    assert child.returncode == 0
    cases = next(line for line in table.splitlines() if line.startswith("all")).split()[1]
    assert f"{cases}/{cases}" in shown.decode()
    assert "cases: refused" not in shown.decode()
    assert table.startswith("family")
    assert "\x1b" not in table


def _read(terminal: int) -> bytes:
    try:
        return os.read(terminal, 4096)
    except OSError:  # on Linux, the other end is closed
        return b""


def test_wrong_answers_are_named_and_the_exit_code_tells() -> None:
    code, out, err = run("--method", "march", "--case", "short chord: a sheet 1e-09")
    assert code == 3
    assert "wrong: short chord: a sheet 1e-09 thick: ray " in err
    assert "\nshort chord: " in f"\n{err}", "the family, and what is hard about the case"
    assert err.count("wrong: ") == 3
    assert out.splitlines()[-3].split()[-1] != "0"


def test_json_lists_every_case_and_all_that_is_wrong() -> None:
    code, out, _ = run("--method", "march", "--case", "short chord: a sheet 1e-09", "--json")
    found = json.loads(out)
    assert code == 3
    assert found["method"] == "march"
    assert len(found["cases"]) == 1
    assert len(found["cases"][0]["wrong"]) == found["families"][0]["wrong"] > 20
    assert found["cases"][0]["why"]


def test_cases_that_a_method_does_not_serve_are_left_out_and_said_to_be() -> None:
    code, out, err = run("--method", "polynomial", "--case", "null lens")
    assert code == 0
    assert "left out, as the method does not serve them; null lens: heart: numerics.method" in err
    assert int(out.splitlines()[1].split()[2]) < 6


def test_a_name_that_no_case_has_is_refused() -> None:
    code, _, err = run("--case", "no such thing")
    assert code == 2
    assert "no case has no such thing in its name" in err


def test_methods_and_precisions_are_those_there_are() -> None:
    assert set(_METHODS) == {"auto", *METHODS}
    assert set(_PRECISIONS) == {"single", "mixed", "double"}
