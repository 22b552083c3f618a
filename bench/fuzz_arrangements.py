"""Hold rays through random arrangements of solids against certified answers.

    python bench/fuzz_arrangements.py [SCENES [SEED]] [--rays N] [--variants N] [--only NAME] [--precision NAME]...

Solids of every kind lie in one another, touch over an area, along an edge or at a point, overlap in part, coincide, or
stand apart (see `random_arrangements`). Every ray is traced in each precision and proved by the oracle, which follows
sets of solids and contact on its own. A ray is wrong if it is decided and differs from what is proved, and no move of
the problem's numbers by some roundings explains that (as `lenscl hardcases` judges). What the oracle cannot decide is
counted by its reason, and so is what the program leaves undecided though it is proved. The exit code is 1 if a ray is
wrong.
"""

from __future__ import annotations

import argparse
import sys
import time
from collections import Counter
from dataclasses import dataclass, field, replace
from functools import cache
from pathlib import Path

import numpy as np
from hard_cases.prove import expected_of
from random_arrangements import ARRANGEMENTS, Arrangement, drawn

import lenscl
from lenscl import RayStatus, device
from lenscl.errors import LensclError
from lenscl.hardcases import ROUNDING, ULPS, Answers, Case
from lenscl.hardcases.judge import judge
from lenscl.reference.oracle import Proof, prove_rays
from lenscl.tracing import RayPaths
from lenscl.tracing.start import locate_sets

PRECISIONS = ("double", "mixed", "single")
_NEAR = 1e-11  # picture coordinates: what is farther off is judged by the ray's condition
_BITS = 512
NEEDLESS = "without need"


@dataclass
class Tally:
    """What came of some scenes."""

    rays: int = 0
    ends: Counter[tuple[str, str]] = field(default_factory=Counter)  # (precision, what) -> rays
    reasons: Counter[str] = field(default_factory=Counter)  # the oracle's
    left: Counter[tuple[str, str, str]] = field(default_factory=Counter)  # (arrangement, precision, why)
    wrong: list[str] = field(default_factory=list)


@cache
def _plain_device() -> device.Device:
    """Return this machine's device as it compiles in a fourth of the time: few lanes, and nothing optimised."""
    here = device.choose()
    return replace(here, widths=(4, 4), build_options=(*here.build_options, "-cl-opt-disable"))


def _clear_starts(one: Arrangement) -> Arrangement:
    """Return the arrangement without rays that start within rounding of a surface: they count as starting on it."""
    _, on = locate_sets(one.scene, one.origins)
    keep = on == 0
    return Arrangement(
        name=one.name, scene=one.scene, text=one.text, origins=one.origins[keep], directions=one.directions[keep]
    )


def look(one: Arrangement, label: str, precisions: tuple[str, ...], tally: Tally, *, tells: bool) -> None:
    """Trace and prove an arrangement's rays, and count what comes of them."""
    one = _clear_starts(one)
    if not len(one.origins):
        return
    proofs = prove_rays(one.scene, one.origins.tolist(), one.directions.tolist(), most_bits=_BITS)
    tally.rays += len(proofs)
    tally.reasons.update(proof.reason for proof in proofs if proof.status is None)
    for precision in precisions:
        paths = lenscl.trace_rays(one.scene, one.origins, one.directions, precision=precision, device=_plain_device())
        suspects = []
        for ray, proof in enumerate(proofs):
            is_decided = paths.status[ray] != RayStatus.UNDECIDED
            what = ("decided" if is_decided else "undecided") + ("" if proof.status is not None else " and unproved")
            tally.ends[precision, what] += 1
            if what == "undecided":
                why = _why_left(one, ray, proof)
                tally.left[one.name, precision, why] += 1
                if tells and (why == NEEDLESS or precision == precisions[0]):
                    print(f"  {label} ray {ray} {precision}: undecided, proved {_said(proof)}: {why}", flush=True)
            elif what == "decided" and not _agrees(paths, ray, proof):
                suspects.append(ray)
        if suspects:
            tally.ends[precision, "looked at by condition"] += len(suspects)
            for ray in suspects:
                if _is_hidden(one, ray, precision, paths, proofs[ray]):
                    tally.ends[precision, "of a way that no moved ray takes"] += 1
                    what = f"{RayStatus(paths.status[ray]).name} after {paths.events[ray]}, proved {_said(proofs[ray])}"
                    print(f"  {label} ray {ray} {precision}: {what}: no moved ray does so", flush=True)
            tally.wrong += _judged(one, label, precision, paths, np.array(suspects), proofs)


def _why_left(one: Arrangement, ray: int, proof: Proof) -> str:
    """Return what becomes of a ray, proved as it is, where it is moved by roundings of double: what it runs beside."""
    beside = _moved(one, ray, ULPS * ROUNDING["double"])
    reasons = sorted({each.reason for each in beside if each.status is None})
    ways = {(each.status, each.events) for each in beside if each.status is not None} | {(proof.status, proof.events)}
    if len(ways) > 1:
        return "rays moved by rounding go other ways"
    return "; ".join(reasons) or NEEDLESS


def _is_hidden(one: Arrangement, ray: int, precision: str, paths: RayPaths, proof: Proof) -> bool:
    """Say whether a ray goes a way that it goes neither as it is nor moved by roundings, the lenses being as they are.

    Where lenses are moved faces in contact come apart, so that condition alone would explain a contact that was missed.
    """
    way = (paths.status[ray] if paths.status[ray] > RayStatus.BEHIND else 0, paths.events[ray])
    size = ULPS * ROUNDING["single" if precision == "single" else "double"]
    beside = [proof, *_moved(one, ray, size), *_moved(one, ray, 4.0 * size)]
    return way not in {
        (each.status if each.status > RayStatus.BEHIND else 0, each.events)
        for each in beside
        if each.status is not None
    }


def _moved(one: Arrangement, ray: int, size: float) -> list[Proof]:
    """Prove a ray that is moved across itself, and turned, in the scene as it is: what is in contact stays so."""
    origin, direction = one.origins[ray], one.directions[ray]
    u = np.cross(direction, np.eye(3)[np.argmin(np.abs(direction))])
    u /= np.linalg.norm(u)
    ways = [c * u + s * np.cross(direction, u) for c, s in ((1, 0), (0, 1), (-1, 0), (0, -1), (0.7, 0.7), (-0.7, -0.7))]
    scale = size * max(1.0, float(np.abs(origin).max()))
    origins = [(origin + scale * way).tolist() for way in ways] * 2
    turns = [(direction + sign * size * way).tolist() for sign in (1.0, -1.0) for way in ways]
    return prove_rays(one.scene, origins, turns, most_bits=_BITS // 2)


def _agrees(paths: RayPaths, ray: int, proof: Proof) -> bool:
    if (paths.status[ray], paths.events[ray]) != (proof.status, proof.events):
        return False
    return proof.st is None or proof.distance(*map(float, paths.st[ray])) <= _NEAR


def _said(proof: Proof) -> str:
    return proof.reason if proof.status is None else f"{proof.status.name} after {proof.events}"


def _judged(
    one: Arrangement, label: str, precision: str, paths: RayPaths, rays: np.ndarray, proofs: list[Proof]
) -> list[str]:
    """Return which of some rays no move of the problem explains."""
    origins, directions = one.origins[rays], one.directions[rays]
    case = Case(name=label, family="", why="", scene=one.text, origins=origins, directions=directions)
    expected = expected_of(case)
    answers = Answers(
        status=paths.status[rays], events=paths.events[rays], st=paths.st[rays].astype(np.float64).reshape(-1, 2)
    )
    level = "single" if precision == "single" else "double"
    told = []
    for each in judge(case, expected, answers, level).wrong:
        ray = rays[each.ray]
        off = proofs[ray].distance(*map(float, paths.st[ray])) if proofs[ray].st is not None else 0.0
        told.append(
            f"{label} ray {ray} {precision}: {each}; traced {RayStatus(paths.status[ray]).name} after "
            f"{paths.events[ray]}, proved {_said(proofs[ray])}, {off:.3g} off"
        )
        print(told[-1], flush=True)
    return told


def main(arguments: list[str]) -> int:
    """Run the scenes; return the exit code."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("scenes", type=int, nargs="?", default=100)
    parser.add_argument("seed", type=int, nargs="?", default=0, help="of the first form")
    parser.add_argument("--rays", type=int, default=24)
    parser.add_argument("--variants", type=int, default=4, help="scenes of one form, that share a kernel")
    parser.add_argument("--only", choices=list(ARRANGEMENTS), default="")
    parser.add_argument("--scale", type=float, default=1.0, help="of the whole")
    parser.add_argument("--shift", type=float, default=0.0, help="of the whole, from the world's origin")
    parser.add_argument("--away", type=float, default=1.0, help="times as far rays start")
    parser.add_argument("--precision", action="append", choices=PRECISIONS)
    parser.add_argument("--tell", action="store_true", help="print rays that are undecided though proved")
    parser.add_argument("--keep", type=Path, help="write the study of every scene here that has a wrong ray")
    asked = parser.parse_args(arguments)
    tally, start, scenes = Tally(), time.perf_counter(), 0
    for number in range(asked.scenes):
        form, seed = asked.seed + number // asked.variants, number % asked.variants
        label = f"{asked.only or list(ARRANGEMENTS)[form % len(ARRANGEMENTS)]} {form}/{seed}"
        try:
            one = drawn(form, seed, asked.rays, asked.only, asked.scale, asked.shift, asked.away)
        except LensclError as error:
            print(f"{label}: refused: {error}", flush=True)
            continue
        before = len(tally.wrong)
        look(one, label, tuple(asked.precision or PRECISIONS), tally, tells=asked.tell)
        scenes += 1
        if scenes % 50 == 0:
            print(f"{scenes} scenes, {tally.rays} rays, {time.perf_counter() - start:.0f} s", flush=True)
        if asked.keep and len(tally.wrong) > before:
            (asked.keep / f"{form}-{seed}.toml").write_text(one.text)
    print(f"{scenes} scenes, {tally.rays} rays, {time.perf_counter() - start:.0f} s, wrong: {len(tally.wrong)}")
    for (precision, what), count in sorted(tally.ends.items()):
        print(f"  {precision}, {what}: {count}")
    for reason, count in tally.reasons.most_common():
        print(f"  unproved: {reason}: {count}")
    for (name, precision, why), count in sorted(tally.left.items()):
        print(f"  undecided though proved: {name}, {precision}: {why}: {count}")
    return 1 if tally.wrong else 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
