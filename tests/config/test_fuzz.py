"""Hostile inputs of every kind, a few thousand of the million that bench/fuzz.py feeds at length."""

from __future__ import annotations

import warnings
from pathlib import Path

import fuzz
import pytest
from fuzz_inputs import Input, made

from lenscl.errors import StudyError

INPUTS = 2500


@pytest.fixture(scope="module")
def tally(tmp_path_factory: pytest.TempPathFactory) -> fuzz.Tally:
    return fuzz.run(12, range(INPUTS), tmp_path_factory.mktemp("fuzz"))


def test_every_input_is_accepted_or_refused_by_an_error_of_ours(tally: fuzz.Tally) -> None:
    assert [str(failure) for failure in tally.failures] == []
    assert sum(tally.answers.values()) == INPUTS


def test_inputs_of_every_kind_are_accepted_and_refused_for_many_reasons(tally: fuzz.Tally) -> None:
    accepted = {kind: count for (kind, answer), count in tally.answers.items() if answer == "accepted"}
    assert accepted["expression"] > INPUTS // 8
    assert accepted["study"] > INPUTS // 50
    assert {"file", "setting"} <= accepted.keys()
    assert len({answer for _, answer in tally.answers}) > 25


def test_a_seed_and_a_number_make_the_same_input_again() -> None:
    assert [made(5, number) for number in range(50)] == [made(5, number) for number in range(50)]
    assert made(5, 1) != made(6, 1)


@pytest.mark.parametrize(
    ("fault", "what"),
    [
        (KeyError("lens"), "KeyError"),
        (RecursionError(), "RecursionError"),
        (RuntimeWarning("overflow"), "RuntimeWarning"),
        (fuzz.LateError("no answer"), "LateError"),
        (StudyError([]), "AssertionError"),  # which says nothing
        (StudyError(["x" * 100_000]), "AssertionError"),
    ],
    ids=lambda each: type(each).__name__,
)
def test_any_other_answer_is_a_failure(
    fault: BaseException, what: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def fails(*_: object, **__: object) -> None:
        if isinstance(fault, Warning):
            warnings.warn(fault, stacklevel=1)
        raise fault

    monkeypatch.setattr(fuzz, "study_from_toml", fails)
    monkeypatch.setattr(fuzz, "made", lambda seed, number: Input("study", "title = 1"))
    (failure,) = fuzz.run(1, [7], tmp_path).failures
    assert failure.what.startswith(what)
    assert failure.number == 7
    assert "title = 1" in str(failure)
