"""What is said of a text that is not TOML: the line, what stands there, and how it is written."""

from __future__ import annotations

import tomllib

import pytest
from hypothesis import given
from hypothesis import strategies as st

from lenscl.config.load import parse_text
from lenscl.errors import StudyError

LINES = [  # a line of the lens, and what is said to be written
    ("n = 1,5", "n = 1.5"),
    ("n = 1,5  # crown", "n = 1.5"),
    ("n = .5", "digits on both sides of its point"),
    ("n = 5.", "digits on both sides of its point"),
    ("n = 05", "no further zeros"),
    ("n = 3/2", "nothing is computed"),
    ("n = 1.5 mm", "a number stands alone"),
    ("n = BK7", 'n = "BK7"'),
    ("n: 1.5", "joined by ="),
    ("n =", "write a value behind n ="),
    ("n = 1.5;", "ends without ;"),
    ("absorbs = True", "write true"),
    ("absorbs = yes", "true or false"),
    ("name = null", "leave the key out"),
    ("name = “one”", "quotation marks are the straight ones"),
    ('name = "one', 'never closed by "'),
    ("centre = (0, 0, 1)", "square brackets, centre = [...]"),
    ("centre = 0, 0, 1", "square brackets, centre = [0, 0, 1]"),
    ("centre = [0; 0; 1]", "separated by commas"),
    ("centre = [0., 0., 1.]", "digits on both sides of its point"),
    ("surface = x^2 + y^2", 'surface = "x^2 + y^2"'),
    ('surface = "C:\\models\\x.stl"', "a backslash is written"),
    ("// a remark", "begins with #"),
    ("n = 1.5 // crown", "begins with #"),
    ("n = 1.5 ; crown", "begins with #"),
    ("n = pi", "n = 3.141592653589793"),
    ("ρ = 0.5", "letters a to z"),
    ("[[lens]", "as many brackets"),
    ("n = { cauchy = [1.5,\n0.1] \n}", "stands on one line"),
    ("centre = [0, 0, 1\n[film]", "never closed by ]"),
]


def problem(text: str) -> str:
    with pytest.raises(StudyError) as caught:
        parse_text(text, "study.toml")
    (only,) = caught.value.problems
    return only


@pytest.mark.parametrize(("line", "instead"), LINES)
def test_a_line_that_is_no_toml_is_shown_with_how_it_is_written(line: str, instead: str) -> None:
    found = problem(f"[source]\nat = [0, 0, 4]\n\n[[lens]]\n{line}\n")
    assert found.startswith("study.toml: is not TOML: line ")
    assert instead in found
    assert found.splitlines()[-1].strip() in line


TWICE = [  # the header and what a study has once, or many times
    ("source", "a study has one source"),
    ("film", "a study has one film"),
    ("picture", "a study has one picture plane"),
    ("medium", "one medium is between all lenses"),
    ("effects", "write the keys of all effects in one"),
    ("numerics", "one method is for all lenses"),
    ("output", "one form of output"),
    ("sweep", "a study has one sweep"),
    ("sweep.axes", "write all axes in one"),
    ("lens", "written [[lens]], with double brackets"),
    ("sweep.zip", "written [[sweep.zip]], with double brackets"),
    ("sweep.exclude", "written [[sweep.exclude]], with double brackets"),
]


@pytest.mark.parametrize(("table", "says"), TWICE)
@pytest.mark.parametrize("second", ["[{}]", "[[{}]]", "[ {} ]  # again"])
def test_a_table_that_is_begun_twice_is_named_with_both_lines(table: str, says: str, second: str) -> None:
    text = f"title = '''\n[{table}]\n'''\n[{table}]\n[other]\na = 1\n{second.format(table)}\n"  # line 2 is of a text
    found = problem(text)
    assert found.startswith("study.toml: line 7: the table ")
    assert "line 4" in found
    assert says in found


def test_a_table_that_keys_began_is_begun_twice_by_its_header() -> None:
    found = problem("film.size = [3, 4]\n[film]\nscale = 2\n")
    assert found.startswith("study.toml: line 2: the table [film] is begun a second time, first in line 1; a study has")


def test_a_key_that_is_given_twice_is_named_with_both_lines_of_its_table() -> None:
    found = problem("[source]\nn = 1\n[[lens]]\nn = 1.5\nname = 'a'\n\"n\" = 1.6\n")
    assert found == "study.toml: line 6: n is given a second time in its table, first in line 4; keep one of the two"


def test_whatever_tomllib_refuses_is_one_problem_of_few_lines() -> None:
    refused = 0

    @given(st.lists(st.sampled_from([*"[]{}=,.'\"#\n \\x1-", "[source]", "[[lens]]", "n = 1", "'''"]), max_size=12))
    def refuse(parts: list[str]) -> None:
        nonlocal refused
        text = "".join(parts)
        try:
            tomllib.loads(text)
        except tomllib.TOMLDecodeError:
            refused += 1
            assert len(problem(text)) < 700
            assert problem(text).count("\n") <= 1

    refuse()
    assert refused > 40
