"""The judge of hard cases: what it lets pass, and what it does not."""

from __future__ import annotations

import ast
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from lenscl import RayStatus
from lenscl.hardcases import REASONS, ROUNDING, ULPS, Answers, Case, Expected, Moved, Verdict, judge, number_of
from lenscl.reference import crossing, landing, oracle, touching

CASE = Case(name="three rays", family="of this test", why="to try the judge", scene="")
Row = tuple[RayStatus, int, float]


def answers(*rows: Row) -> Answers:
    """Return answers whose s and t are the same number; -1 for none."""
    status, events, s = (np.array(column) for column in zip(*rows, strict=True))
    return Answers(status=status.astype(np.uint8), events=events.astype(np.uint8), st=np.stack([s, s], axis=1) * 1.0)


LANDS: Row = (RayStatus.PICTURE, 2, 0.25)
BEHIND: Row = (RayStatus.BEHIND, 4, -1.0)
BESIDE: Row = (RayStatus.OFF_PICTURE, 2, 1.5)
HANGS = 2  # the number of the ray whose path hangs on rounding
SPREAD = 1e-12


def expected(*beside: Row, unstable_in: tuple[str, ...] = ("double", "single")) -> Expected:
    """Return three rays; the last hangs on rounding where said so, and then has answers beside its own."""

    def moved(level: str) -> Moved:
        hangs = level in unstable_in
        return Moved(
            spread=np.full(3, SPREAD),
            is_stable=np.array([True, True, not hangs]),
            beside=answers(*(beside or (BESIDE,))),
            ray=np.full(len(beside or (BESIDE,)), HANGS, np.int32),
        )

    exact = answers(LANDS, BEHIND, BESIDE)
    return Expected(answers=exact, moved={"double": moved("double"), "single": moved("single")})


def judged(*rows: Row, of: Expected | None = None, case: Case = CASE) -> Verdict:
    return judge(case, of or expected(), answers(*rows), "double")


def complaints(verdict: Verdict) -> list[tuple[int | None, str]]:
    return [(each.ray, each.what) for each in verdict.wrong]


def test_exact_answers_are_right() -> None:
    verdict = judged(LANDS, BEHIND, BESIDE)
    assert complaints(verdict) == []
    assert (verdict.rays, verdict.worst, verdict.beside, verdict.undecided) == (3, 0.0, 0, 0)


@pytest.mark.parametrize(("part", "is_wrong"), [(0.5, False), (0.99, False), (1.1, True), (1e6, True)])
def test_a_place_may_be_off_by_what_moves_of_the_rays_numbers_do(part: float, is_wrong: bool) -> None:
    allowed = SPREAD + ROUNDING["double"]
    verdict = judged((RayStatus.PICTURE, 2, 0.25 + part * allowed), BEHIND, BESIDE)
    assert [ray for ray, _ in complaints(verdict)] == ([0] if is_wrong else [])
    assert verdict.worst == pytest.approx(part * ULPS, rel=1e-3)


def test_another_path_is_wrong_where_no_move_changes_it() -> None:
    verdict = judged((RayStatus.PICTURE, 3, 0.25), BEHIND, BESIDE)
    assert complaints(verdict) == [(0, "ends PICTURE after 3 events; it must end PICTURE after 2 events")]
    assert judged(LANDS, LANDS, BESIDE).wrong[0].ray == 1


OTHER: Row = (RayStatus.PICTURE, 4, 0.5)
NEAR_OTHER: tuple[Row, ...] = tuple((RayStatus.PICTURE, 4, 0.5 + k * 1e-5) for k in range(4))


def test_another_path_is_counted_where_a_move_leads_to_it_and_to_its_place() -> None:
    of = expected(BESIDE, *NEAR_OTHER)
    verdict = judged(LANDS, BEHIND, OTHER, of=of)
    assert complaints(verdict) == []
    assert (verdict.beside, verdict.untold) == (1, 0)
    far = judged(LANDS, BEHIND, (RayStatus.PICTURE, 4, 0.6), of=of)
    assert [ray for ray, _ in complaints(far)] == [HANGS]
    assert far.beside == 0
    unseen = judged(LANDS, BEHIND, (RayStatus.TRAPPED, 5, -1.0), of=expected(BESIDE))
    assert [ray for ray, _ in complaints(unseen)] == [HANGS]


@pytest.mark.parametrize(
    ("beside", "taken"),
    [
        ((BESIDE, OTHER), (RayStatus.PICTURE, 4, 0.9)),  # one place does not tell how far others lie
        ((BESIDE, OTHER), (RayStatus.PICTURE, 3, 0.9)),  # between two numbers of surfaces there may be others
        (NEAR_OTHER, (RayStatus.PICTURE, 3, 0.9)),  # moves that all leave the exact path have jumped over some
        ((BESIDE, OTHER), (RayStatus.TRAPPED, 6, -1.0)),  # where two paths meet there may be more
    ],
)
def test_what_the_moves_do_not_tell_is_counted_apart(beside: tuple[Row, ...], taken: Row) -> None:
    verdict = judged(LANDS, BEHIND, taken, of=expected(*beside))
    assert complaints(verdict) == []
    assert (verdict.beside, verdict.untold) == (0, 1)


def test_no_ray_meets_many_more_surfaces_than_moves_do() -> None:
    of = expected(*((RayStatus.PICTURE, events, 0.5) for events in (2, 3, 4)))
    verdict = judged(LANDS, BEHIND, (RayStatus.TRAPPED, 200, -1.0), of=of)
    assert [ray for ray, _ in complaints(verdict)] == [HANGS]


def test_the_same_path_of_which_no_move_tells_the_place_is_counted_apart() -> None:
    of = expected()
    of.moved["double"].spread[HANGS] = 0.0
    verdict = judged(LANDS, BEHIND, (RayStatus.OFF_PICTURE, 2, 1.9), of=of)
    assert complaints(verdict) == []
    assert verdict.untold == 1


def test_a_case_that_is_exact_has_no_excuse() -> None:
    case = replace(CASE, is_exact=True)
    assert complaints(judged(LANDS, BEHIND, BESIDE, case=case)) == []
    verdict = judged(LANDS, BEHIND, OTHER, of=expected(OTHER), case=case)
    assert [ray for ray, _ in complaints(verdict)] == [HANGS]
    beside = judged((RayStatus.PICTURE, 2, np.nextafter(0.25, 0.0)), BEHIND, BESIDE, case=case)
    assert [ray for ray, _ in complaints(beside)] == [0]


def test_undecided_is_judged_by_the_finest_precision_that_the_device_has() -> None:
    undecided = answers(LANDS, BEHIND, (RayStatus.UNDECIDED, 1, -1.0))
    of = expected(unstable_in=("single",))
    assert judge(CASE, of, undecided, "single", "single").undecided == 1
    assert [each.ray for each in judge(CASE, of, undecided, "single", "double").wrong] == [HANGS]


def test_undecided_is_right_only_where_double_precision_cannot_decide() -> None:
    undecided: Row = (RayStatus.UNDECIDED, 1, -1.0)
    assert judged(LANDS, BEHIND, undecided).undecided == 1
    assert complaints(judged(LANDS, BEHIND, undecided)) == []
    for verdict, ray in (
        (judged(LANDS, undecided, BESIDE), 1),
        (judged(LANDS, BEHIND, undecided, of=expected(unstable_in=("single",))), HANGS),
    ):
        assert complaints(verdict) == [(ray, "is undecided without need")]
        assert verdict.undecided == 0


def test_undecided_is_right_where_f_is_beyond_the_doubles_and_only_there() -> None:
    undecided: Row = (RayStatus.UNDECIDED, 1, -1.0)
    for ray in range(3):
        case = replace(CASE, lacks_values=np.arange(3) == ray)
        verdict = judged(LANDS, undecided, BESIDE, case=case)
        assert complaints(verdict) == ([] if ray == 1 else [(1, "is undecided without need")])
        assert verdict.undecided == (ray == 1)


def test_a_decided_ray_of_which_nothing_is_known_is_a_guess_where_f_has_gaps() -> None:
    known, guess = (RayStatus.PICTURE, 9, 0.1), (RayStatus.UNDECIDED, 0, -1.0)
    dark = expected(guess)
    dark = replace(dark, answers=answers(LANDS, BEHIND, guess), reasons=np.array([0, 0, number_of("F has no value")]))
    gaps = replace(CASE, has_gaps=True)
    verdict = judged(LANDS, BEHIND, known, of=dark, case=gaps)
    assert complaints(verdict) == [(HANGS, "is decided, and nothing tells how: no value of F")]
    assert complaints(judged(LANDS, BEHIND, known, of=dark)) == []
    left = judged(LANDS, BEHIND, guess, of=dark, case=gaps)
    assert (complaints(left), left.undecided, left.reasons) == ([], 1, {"no value of F": 1})
    told = replace(dark, moved=expected(LANDS).moved)  # a move tells: it is no gap of F
    assert complaints(judged(LANDS, BEHIND, LANDS, of=told, case=gaps)) == []


def test_undecided_rays_are_counted_by_reason_and_sum_up() -> None:
    undecided: Row = (RayStatus.UNDECIDED, 1, -1.0)
    one, two = (replace(CASE, scene="[[lens]]\n" * count) for count in (1, 2))
    for case, of, why in (
        (one, expected(BESIDE, OTHER), "rim"),
        (two, expected(BESIDE, OTHER), "rim before another lens"),
        (one, expected(BESIDE, (RayStatus.TRAPPED, 2, -1.0)), "event limit"),
        (one, expected(BESIDE, (RayStatus.TRAPPED, 9, -1.0)), "rim"),  # it is another surface that decides
        (one, expected(BESIDE, (RayStatus.TOTAL_REFLECTION, 1, -1.0)), "critical angle"),
        (one, replace(expected(BESIDE), reasons=np.array([0, 0, number_of("it grazes")])), "grazing"),
        (replace(one, lacks_values=np.array([False, False, True])), expected(BESIDE), "no value of F"),
    ):
        verdict = judged(LANDS, BEHIND, undecided, of=of, case=case)
        assert (verdict.reasons, verdict.undecided) == ({why: 1}, 1)
    assert judged(LANDS, undecided, BESIDE).reasons == {}  # it is wrong, and not counted
    assert judged(LANDS, undecided, BESIDE).needless == 1


def test_every_reason_of_the_oracle_has_its_number() -> None:
    said = set()
    for module in (crossing, landing, oracle, touching):
        for found in ast.walk(ast.parse(Path(module.__file__).read_text(encoding="utf-8"))):
            match found:
                case ast.Call(func=ast.Name(id="UndecidableError"), args=[argument]):
                    said.add(_text(argument))
                case ast.Assign(targets=[ast.Name(id="_TOUCH" | "_NO_VALUE")], value=value):
                    said.add(_text(value))
                case ast.keyword(arg="reason", value=ast.Constant(value=str(text))):
                    said.add(text)
    said -= {""}
    assert len(said) >= 14
    assert all(REASONS[number_of(each)] for each in said)
    assert number_of("") == 0
    with pytest.raises(ValueError, match="expected one reason"):
        number_of("a new word of the oracle's")


def _text(value: ast.expr) -> str:
    """Return a constant text, and of one that is put together its constant parts; "" of a name's."""
    if isinstance(value, ast.JoinedStr):
        return "".join(str(part.value) for part in value.values if isinstance(part, ast.Constant))
    return str(value.value) if isinstance(value, ast.Constant) else ""


def test_a_path_that_nothing_is_known_of_is_not_judged() -> None:
    of = expected((RayStatus.UNDECIDED, 0, -1.0))
    assert complaints(judged(LANDS, BEHIND, (RayStatus.PICTURE, 9, 0.1), of=of)) == []


@pytest.mark.parametrize(
    "impossible",
    [
        (RayStatus.PICTURE, 2, np.nan),
        (RayStatus.PICTURE, 2, np.inf),
        (RayStatus.BEHIND, 2, 0.5),  # has no place
        (RayStatus.PICTURE, 2, 1.0),  # the picture is half open
        (RayStatus.OFF_PICTURE, 2, 0.5),
    ],
)
def test_what_cannot_be_is_wrong_whatever_the_ray(impossible: Row) -> None:
    of = expected(*((RayStatus.PICTURE, events, 0.5) for events in (2, 3, 4)))
    assert HANGS in [ray for ray, _ in complaints(judged(LANDS, BEHIND, impossible, of=of))]
