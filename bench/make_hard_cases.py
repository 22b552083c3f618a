"""Make the pack of hard cases that `lenscl hardcases` runs: aim the rays, prove how they end, write it all down.

What is in the pack already and has not changed is not proved again; the whole takes an hour or two.

    python bench/make_hard_cases.py [--all | --count | NAME ...]

With names, cases whose names contain one of them are proved again, and no others; `--all` proves everything again, as
is needed where the moves or the oracle have changed. Answers are written down as they come, in the place of older ones.
How many rays may be left undecided is kept as it is: `pack/undecided.toml` is counted by `--count`, on this machine.
Needs python-flint: pip install 'lenscl[accuracy]'.
"""

from __future__ import annotations

import sys
import time
from collections.abc import Iterator
from concurrent.futures import ProcessPoolExecutor, as_completed
from dataclasses import replace

from hard_cases import (
    arranged,
    axes,
    expressions,
    laws,
    noisy,
    opaque,
    paths,
    pictured,
    refraction,
    roots,
    screens,
    shapes,
    sizes,
    unknown,
    words,
)
from hard_cases.prove import expected_of

from lenscl import device
from lenscl.errors import LensclError
from lenscl.hardcases import Case, Expected, Pack, by_family, load_pack, most_undecided, run_pack, write_pack

_SECONDS = 30.0  # between one writing and the next


def every_case() -> Iterator[Case]:
    """Yield all cases, family by family."""
    for module in (
        refraction,
        roots,
        sizes,
        shapes,
        paths,
        screens,
        expressions,
        laws,
        unknown,
        noisy,
        opaque,
        axes,
        arranged,
        words,
        pictured,
    ):
        yield from module.cases()


def main(arguments: list[str]) -> None:
    """Write the pack."""
    if arguments == ["--count"]:
        return _count()
    is_all, names = arguments == ["--all"], arguments
    if not is_all and any(argument.startswith("-") for argument in arguments):
        raise SystemExit(__doc__)
    known = _kept()
    cases = list(every_case())
    twice = {case.name for case in cases if [each.name for each in cases].count(case.name) > 1}
    if twice:
        raise SystemExit(f"two cases are called {', '.join(sorted(twice))}")
    for name in [] if is_all else names:
        if not any(name in case.name for case in cases):
            raise SystemExit(f"no case is called {name}, nor has a name that contains it")
    wanted = [
        case
        for case in cases
        if not case.refused
        and (is_all or (any(name in case.name for name in names) if names else case.key not in known))
    ]
    start = written = time.perf_counter()
    with ProcessPoolExecutor() as pool:
        proofs = {pool.submit(expected_of, case): case for case in wanted}
        for proof in as_completed(proofs):
            case, expected = proofs[proof], proof.result()
            known[case.key] = expected
            unsure = sum(int((~moved.is_stable).sum()) for moved in expected.moved.values())
            count, seconds = len(expected.answers.status), time.perf_counter() - start
            print(f"{seconds:7.1f} s  {case.name}: {count} rays, {unsure} times unstable", flush=True)
            if time.perf_counter() > written + _SECONDS:
                write_pack(_pack(cases, known))
                written = time.perf_counter()
    pack = _pack(cases, known)
    write_pack(pack)
    rays = sum(len(each.answers.status) for each in pack.expected.values())
    print(f"{len(pack.cases)} cases, {rays} rays, {len({case.family for case in pack.cases})} families")


def _kept() -> dict[str, Expected]:
    try:
        pack = load_pack()
    except LensclError:
        return {}
    return {case.key: pack.expected[case.name] for case in pack.cases if case.name in pack.expected}


def _pack(cases: list[Case], known: dict[str, Expected]) -> Pack:
    proved = [case for case in cases if case.refused or case.key in known]
    expected = {case.name: known[case.key] for case in proved if not case.refused}
    return Pack(cases=tuple(proved), expected=expected, most_undecided=most_undecided())


def _count() -> None:
    """Count the rays that each guaranteed method leaves undecided, by precision, method and family."""
    pack = load_pack()
    counts: dict[str, dict[str, dict[str, int]]] = {}
    for precision in ("double", "mixed", "single"):
        counts[precision] = {}
        for method in ("auto", "guarded", "interval", "joined", "planes", "polynomial"):
            found = list(run_pack(pack, method=method, precision=precision, device=device.choose()))
            families = sorted(by_family(found), key=lambda each: each.family)
            counts[precision][method] = {each.family: each.undecided for each in families if each.undecided}
            print(f"{precision}, {method}: {sum(each.undecided for each in found)}", flush=True)
    write_pack(replace(pack, most_undecided=counts))


if __name__ == "__main__":
    main(sys.argv[1:])
