"""The pack on this machine's device: nothing is wrong by any guaranteed method, and a march is found out."""

from __future__ import annotations

import pytest
from probe import plain_device

from lenscl import device
from lenscl.config import Scene
from lenscl.errors import BuildError
from lenscl.hardcases import Case, Pack, Verdict, by_family, load_pack, run, run_pack
from lenscl.tracing import RayMap, RayPaths

# Rays that double does not decide at first, and twice its digits do, or nothing
AGAIN = {"tangent": 20, "short chord": 40, "bifolia": 130, "lens after lens": 90, "expression": 170, "start": 100}
# Roundings as a ray's condition magnifies them; 3.7 was seen in double, 5.5 in the second edition
WORST = {"double": 6.0, "single": 16.0, "mixed": 16.0}
# Shares of rays whose path may be another than the exact one, or is not told
BESIDE: dict[str, dict[str, float]] = {
    "double": {"expression": 0.1, "start": 0.05},
    "single": {
        **{"critical angle": 0.35, "grazing incidence": 0.08, "expression": 0.1, "offset": 0.07, "torus": 0.05},
        **{"twin roots": 0.03, "screens": 0.02, "tangent": 0.01, "short chord": 0.01, "start": 0.05},
    },
}
# What a first step of Newton's method that is trusted too soon leaves off, in mixed
TRUSTS = ("bifolia: down the funnel", "reversed: bifolia")
LONGEST = "expression: 500 terms"  # ten times a usual kernel
# In single, kernels that are like another's of their family
LIKE_OTHERS = (
    *("expression: square root of 0", "expression: no value inside", "expression: huge slopes"),
    *("expression: disconnected parts", LONGEST, "twin roots: 1e-06 apart", "twin roots: 1e-09 apart"),
)
SMALL = ("critical angle: the flat", "tangent: torus", "units: sphere", "start: torus", "screens:", "refused: a")
# Of the later editions, what is run each time: a case of each kind
FEW = (
    *("unknown: min: ball and ring", "unknown: max: no solid", "unknown: max with -infinity, of four"),
    *("unknown: tanh: of a quotient", "unknown: a wall without values", "unknown: a pole, first"),
    *("noisy: a ball by numbers of 1e+06", "noisy: first of two", "noisy: foci 1000 "),
    *("opaque: torus", "opaque: grazing a sphere of 0.5", "opaque: a needle", "opaque: from within a sphere of 1.5"),
    *("axis: a superellipsoid of 1.5, 1.5", "axis: a superellipsoid of 2, 1", "axis: the cube root of F, a rounded"),
    *("axis: F^3, a rounded", "axis: a shell by", "axis: a film of 7 x 7 before a superellipsoid of 1"),
    *(
        "arrangements: doublet of a prescription from afar",
        "arrangements: slabs 1e-12",
        "arrangements: stacked slabs, 1",
    ),
    *("words: arcs", "pictures in glass: half ball, on its", "pictures in glass: cutting a solid, ring, tilted"),
    *("pictures in glass: a stain in resin, z = 0.05", "pictures in glass: where two blocks touch"),
)


@pytest.fixture(scope="module")
def pack() -> Pack:
    return load_pack()


def verdicts(pack: Pack, method: str, precision: str) -> list[Verdict]:
    """Run a pack; the longest of its kernels for one ray to a packet, which takes a fourth of the compiling."""
    found: dict[str, Verdict] = {}
    for here, is_long in ((device.choose(), False), (plain_device(1, 1), True)):
        cases = tuple(case for case in pack.cases if (case.name == LONGEST) == is_long)
        part = Pack(cases=cases, expected=pack.expected)
        found |= {each.case.name: each for each in run_pack(part, method=method, precision=precision, device=here)}
    return [found[case.name] for case in pack.cases]


def complaints(some: list[Verdict]) -> list[str]:
    return [f"{each.case.name}: {wrong}" for each in some for wrong in each.wrong]


def too_many(pack: Pack, some: list[Verdict], method: str, precision: str) -> dict[str, int]:
    most = pack.most_undecided[precision][method]
    return {each.family: each.undecided for each in by_family(some) if each.undecided > most.get(each.family, 0)}


@pytest.mark.parametrize(
    ("precision", "families"),
    [("double", ()), ("single", tuple(BESIDE["single"])), pytest.param("single", (), marks=pytest.mark.slow)],
    ids=["double", "single, where rounding decides", "single"],
)
def test_nothing_in_the_pack_is_wrong(pack: Pack, precision: str, families: tuple[str, ...]) -> None:
    beside = LIKE_OTHERS if families else ()
    first = [case for case in pack.cases if case.edition == 1]
    names = [case.name for case in first if case.name not in beside and (not families or case.family in families)]
    chosen = pack.having(names)
    found = verdicts(chosen, "auto", precision)
    assert [each.case.name for each in found] == [case.name for case in chosen.cases]
    assert complaints(found) == []
    assert [each.refusal for each in found if each.refusal] == []
    assert sum(each.rays for each in found) > (7_000 if families else 20_000)
    assert max(each.worst for each in found) < WORST[precision]
    assert too_many(pack, found, "auto", precision) == {}
    # What rounding decides is bounded, family by family; and the axis of the bifolia is beyond any number of digits
    for family in by_family(found):
        assert sum(family.reasons.values()) == family.undecided, family
        assert precision == "single" or family.again <= AGAIN.get(family.family, 0), family
        assert family.beside + family.untold <= BESIDE[precision].get(family.family, 0) * family.rays, family
    axis = [each.undecided for each in found if each.case.name == "bifolia: the axis"]
    assert axis == ([] if families else [4])


@pytest.mark.parametrize(
    ("precision", "names"),
    [
        ("double", FEW),
        *(pytest.param(precision, (), marks=pytest.mark.slow) for precision in ("double", "single", "mixed")),
    ],
    ids=["double, a few", "double", "single", "mixed"],
)
def test_nothing_of_later_editions_is_wrong(pack: Pack, precision: str, names: tuple[str, ...]) -> None:
    later = Pack(cases=tuple(case for case in pack.cases if case.edition > 1), expected=pack.expected).having(names)
    assert all(any(name in case.name for case in later.cases) for name in names)
    found = verdicts(later, "auto", precision)
    assert complaints(found) == []
    assert [each.refusal for each in found if each.refusal] == []
    assert sum(each.rays for each in found) > (500 if names else 2_500)
    assert max(each.worst for each in found) < WORST[precision]
    assert too_many(pack, found, "auto", precision) == {}
    families = by_family(found)
    assert {each.family for each in families} == {case.family for case in pack.cases if case.edition > 1}
    for family in families:
        assert sum(family.reasons.values()) == family.undecided, family


@pytest.mark.parametrize(
    ("method", "precision"),
    [
        ("polynomial", "double"),
        ("guarded", "double"),
        ("interval", "single"),
        ("guarded", "single"),
        *(
            pytest.param(method, precision, marks=pytest.mark.users_kernels)
            for method, precision in (("interval", "double"), ("polynomial", "single"), ("auto", "mixed"))
        ),
    ],
)
def test_no_guaranteed_method_is_wrong(pack: Pack, method: str, precision: str, request: pytest.FixtureRequest) -> None:
    is_whole = request.config.getoption("--slow")
    few = (*SMALL, *TRUSTS) if precision == "mixed" else SMALL
    found = verdicts(pack if is_whole else pack.having(few), method, precision)
    assert complaints(found) == []
    assert too_many(pack, found, method, precision) == {}
    assert sum(each.rays for each in found) > (10_000 if is_whole else 1_000)


def test_a_march_is_found_out(pack: Pack) -> None:
    found = verdicts(pack.having(["short chord", "tangent: torus"]), "march", "double")
    assert sum(len(each.wrong) for each in found) > 100
    assert {each.case.family for each in found if each.wrong} == {"short chord", "tangent"}


def test_a_case_that_has_to_equal_another_is_run_beside_it(pack: Pack) -> None:
    chosen = pack.having(["units: torus, 2^20"])
    assert [case.name for case in chosen.cases] == ["units: torus", "units: torus, 2^20"]
    assert complaints(verdicts(chosen, "auto", "double")) == []


def test_a_case_that_is_not_traced_is_wrong_and_ends_no_run(pack: Pack, monkeypatch: pytest.MonkeyPatch) -> None:
    chosen = pack.having(["units: torus, 2^20"])  # compared with the one that breaks
    first, *others = [case.name for case in chosen.cases]
    trace = run.traced

    def breaks_once(case: Case, scene: Scene, on: device.Device) -> RayMap | RayPaths:
        if case.name == first:
            raise BuildError("the driver refuses it")
        return trace(case, scene, on)

    monkeypatch.setattr(run, "traced", breaks_once)
    found = verdicts(chosen, "auto", "double")
    assert [each.case.name for each in found] == [first, *others]
    assert complaints(found) == [f"{first}: is not traced: the driver refuses it"]
    assert others
    assert all(each.rays for each in found[1:])
