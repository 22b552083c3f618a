"""Feed hostile studies, expressions, files and settings to the program, a million at a time, and count the answers.

    python bench/fuzz.py [INPUTS [SEED]] [--workers N]

Whatever is read must be accepted or refused by an error of our own, within two seconds of processor time, and without
keeping memory. What is accepted goes on: to the points of the study, its hard spots, and the text of its kernel, which
is not compiled. A failure is printed with the input, which `fuzz_inputs.made(SEED, NUMBER)` makes again; the exit code
is 1 if there is any. Tests run the same with a few thousand inputs.

At length it was run on 2026-11-29, a million inputs of seed 4, in 33 minutes on two busy cores: none took two seconds,
no worker grew by more than 28 MiB. Two failed, and are mended: numpy warned of a reciprocal beyond the largest number
while singular points were sought, and a text with half a pair of surrogates, which no file can hold, was not refused.
"""

from __future__ import annotations

import argparse
import multiprocessing
import os
import re
import resource
import signal
import sys
import tempfile
import time
import traceback
import warnings
import zlib
from collections import Counter
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field
from functools import cache
from itertools import islice
from pathlib import Path
from typing import Any

import numpy as np
from fuzz_inputs import BOX, NAMES, STUDIES, Input, made

from lenscl.codegen import Structure, kernel_source
from lenscl.config import Scene, Study, load_study, parse_override, scene_from_toml, study_from_toml
from lenscl.device import Device
from lenscl.effects import TOTAL, called
from lenscl.errors import ExpressionError, LensclError, StudyError
from lenscl.expr import bounds, evaluate, evaluate_with_error, gradient, parse
from lenscl.expr.printing import MAX_TEXT
from lenscl.lenses import user_surface
from lenscl.methods import METHODS, choose
from lenscl.sweep import study_hard_spots
from lenscl.tracing.structure import structure_of

LONGEST_ANSWER = 2.0  # seconds of processor time
MOST_GROWTH = 64 * 2**20  # bytes that a worker's peak memory may grow by in the second half of its work
_LONGEST_MESSAGE = 40_000  # characters
_CHUNK = 1000
_DEEP = 10  # one in so many accepted inputs goes to the hard spots and the kernel's text, too
_POINTS = 5  # of a study, that are built
_NOWHERE = Device(platform="none", name="none", driver="none", kind="cpu", has_double=True, widths=(16, 8), handle=None)
# What a refusal says, by which refusals are counted
_REFUSALS = (
    *("is not TOML", "is not UTF-8", "nested", "unknown key", "unknown function", "unknown name", "unexpected"),
    *("more than", "points", "does not read", "division by zero", "no finite value", "attributes", "is not allowed"),
    *("is missing", "bracket", "is written like", "too large", "exponents", "operand", "comma", "depend on", "bounds"),
    *("must lie", "strictly inside", "is not available", "must be", "must not", "cannot", "at most", "varies"),
    *("is required", "only one", "empty", "is read only", "unknown surface", "second time", "single table"),
    *("looks like", "double brackets", "lens"),
)


@dataclass(frozen=True, slots=True)
class Failure:
    """An input that was answered by something else than an error of ours, or too late."""

    number: int
    given: Input
    what: str  # the exception and where it came from
    trace: str

    def __str__(self) -> str:
        return f"input {self.number}, {self.given.kind}: {self.what}\n  {self.given.content[:2000]!r}\n{self.trace}"


@dataclass
class Tally:
    """What came of some inputs."""

    answers: Counter[tuple[str, str]] = field(default_factory=Counter)  # (kind, answer) -> inputs
    failures: list[Failure] = field(default_factory=list)
    slowest: tuple[float, int] = (0.0, -1)  # seconds, number
    worker: int = 0
    peak: int = 0  # bytes

    def add(self, other: Tally) -> None:
        self.answers += other.answers
        self.failures += other.failures
        self.slowest = max(self.slowest, other.slowest)


class LateError(BaseException):
    """An answer that was given up; no `except Exception` takes it."""


def answer(given: Input, folder: Path) -> str:
    """Feed one input to the program; return "accepted", or what it was refused for. Files are written to the folder.

    Raises
    ------
    Exception
        Whatever is no error of ours.
    """
    deep = zlib.crc32(repr(given.content).encode()) % _DEEP == 0
    try:
        match given.kind:
            case "expression":
                _read_expression(str(given.content), deep)
            case "study":
                _go_on(study_from_toml(str(given.content), folder=folder), deep)
            case "file":
                path = folder / f"{os.getpid()}.toml"
                path.write_bytes(given.content)  # type: ignore[arg-type]
                _go_on(load_study(path), deep)
            case "setting":
                _go_on(_study(given.study, folder).with_overrides(dict([parse_override(str(given.content))])), deep)
    except LensclError as error:
        return f"refused: {_kind(error, given)}"
    return "accepted"


def _kind(error: LensclError, given: Input) -> str:
    message = str(error)
    assert 0 < len(message) < _LONGEST_MESSAGE, f"a message of {len(message)} characters"
    if isinstance(error, ExpressionError):
        assert 0 <= error.column <= len(given.content), "the column lies outside the expression"
    first = error.problems[0] if isinstance(error, StudyError) else message
    return next((words for words in _REFUSALS if words in first), "other")


def _read_expression(text: str, deep: bool) -> None:
    """Read an expression; spell it again, compute with it, and write its kernel."""
    expr = parse(text, NAMES)
    spelled = str(expr)
    assert len(spelled) >= MAX_TEXT or parse(spelled, NAMES) is expr, "what is printed does not read back"
    numbers = np.array([0.0, 1.0, -0.5, 1e-9, 1e9, -1e300, 1e300])
    at: dict[str, Any] = {name: np.roll(numbers, place) for place, name in enumerate(NAMES)}
    value, error = evaluate_with_error(expr, at)
    assert np.broadcast_shapes(value.shape, error.shape) in ((), numbers.shape)
    low, high = bounds(expr, dict.fromkeys(NAMES, (-1.0, 2.0)))
    middle = evaluate(expr, dict.fromkeys(NAMES, 0.5))
    assert np.isnan(middle) or low <= middle <= high, "a value lies outside its bounds"
    if not deep:
        return
    gradient(expr)
    surface = user_surface(text, NAMES[3:], BOX)  # type: ignore[arg-type]
    number = zlib.crc32(text.encode("utf-8", "backslashreplace"))
    methods = [row for name in METHODS if (row := choose(name, is_polynomial=surface.polynomial_form is not None))]
    _check_text(
        Structure(
            lenses={0: surface},
            rays=("point", "parallel", "given")[number % 3],  # type: ignore[arg-type]
            methods={0: methods[number % len(methods)]},
            ends="map",
            snell="exact",
            effects=called({}, facts={TOTAL}),
            precision=("single", "double", "mixed")[number // 3 % 3],  # type: ignore[arg-type]
            width=8,
            run=1,
            parks=False,
        )
    )


def _go_on(study: Study, deep: bool) -> None:
    """Do with a valid study all that comes before a kernel is compiled."""
    assert scene_from_toml(study.scene.to_toml()) == study.scene, "a scene's text does not read back"
    count, listed = study.point_count(), 0
    for point in islice(study.points(), _POINTS):
        listed += 1
        scene = _scene(point)
        if deep and scene is not None:
            _check_text(structure_of(scene, scene.source.kind, "map", _NOWHERE))
            deep = False
            study_hard_spots(study, most_points=1)
    assert listed == min(count, _POINTS), "points are not as many as were counted"


def _scene(point: Any) -> Scene | None:
    try:
        scene: Scene = point.scene
    except StudyError:
        return None
    return None if scene.numerics.accuracy is not None else scene


def _check_text(structure: Structure) -> None:
    text = re.sub(r"//.*", "", kernel_source(structure).text)
    for opening, closing in ("{}", "()"):
        assert text.count(opening) == text.count(closing), f"{opening} and {closing} do not match in the kernel's text"
    assert not re.search(r"\b(nan|inf)\b", text), "a number without a value in the kernel's text"


@cache
def _study(number: int, folder: Path) -> Study:
    return study_from_toml(STUDIES[number], folder=folder)


def run(seed: int, numbers: Sequence[int], folder: Path, watch: Callable[[bool], None] = lambda starts: None) -> Tally:
    """Feed the inputs of some numbers to the program.

    Parameters
    ----------
    seed, numbers
        As for `fuzz_inputs.made`.
    folder : Path
        For files, and what studies are relative to: an empty one.
    watch : callable, optional
        Told when an input starts and when it has been answered.
    """
    tally = Tally(worker=os.getpid())
    with warnings.catch_warnings():
        warnings.simplefilter("error")  # the user would read it
        for number in numbers:
            given = Input("none", "")
            start = 0.0
            try:
                given = made(seed, number)
                start = time.process_time()
                watch(True)
                found = answer(given, folder)
                watch(False)
            except (Exception, LateError) as error:
                found = "FAILED"
                tally.failures.append(_failure(number, given, error))
            tally.answers[given.kind, found] += 1
            tally.slowest = max(tally.slowest, (time.process_time() - start, number))
    tally.peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * 1024
    return tally


def _failure(number: int, given: Input, error: BaseException) -> Failure:
    frames = traceback.extract_tb(error.__traceback__)
    last = next((f"{Path(f.filename).name}:{f.lineno}" for f in reversed(frames) if "lenscl" in f.filename), "")
    trace = "".join(traceback.format_tb(error.__traceback__)[-6:])
    return Failure(number, given, f"{type(error).__name__}: {error} at {last}"[:300], trace)


# --- at length ---


def _begin() -> None:
    """Make a worker ready: an answer that takes too long is given up."""

    def give_up(*_: Any) -> None:
        raise LateError(f"no answer within {LONGEST_ANSWER:g} s of processor time")

    signal.signal(signal.SIGPROF, give_up)
    signal.signal(signal.SIGINT, signal.SIG_IGN)


def _watch(starts: bool) -> None:
    signal.setitimer(signal.ITIMER_PROF, LONGEST_ANSWER if starts else 0.0)


def _work(task: tuple[int, range, Path]) -> Tally:
    return run(*task, _watch)


def _chunks(seed: int, inputs: int, folder: Path) -> Iterator[tuple[int, range, Path]]:
    for first in range(0, inputs, _CHUNK):
        yield seed, range(first, min(first + _CHUNK, inputs)), folder


def _count(text: str) -> int:
    if (count := int(text)) < 1:
        raise argparse.ArgumentTypeError(f"must be at least 1, is {count}")
    return count


def main() -> int:
    reader = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    reader.add_argument("inputs", nargs="?", type=_count, default=100_000)
    reader.add_argument("seed", nargs="?", type=int, default=1)
    reader.add_argument("--workers", type=_count, default=1)
    asked = reader.parse_args()
    total, peaks, start, told = Tally(), {}, time.perf_counter(), 0.0
    with tempfile.TemporaryDirectory() as folder, multiprocessing.Pool(asked.workers, _begin) as pool:
        for tally in pool.imap_unordered(_work, _chunks(asked.seed, asked.inputs, Path(folder))):
            for failure in tally.failures:
                print(failure, flush=True)
            total.add(tally)
            peaks.setdefault(tally.worker, []).append(tally.peak)
            done, passed = sum(total.answers.values()), time.perf_counter() - start
            if passed - told > 10.0 or done == asked.inputs:
                told = passed
                slowest = f"slowest {total.slowest[0]:.2f} s ({total.slowest[1]})"
                print(
                    f"{done:9,} inputs {done / passed:6.0f} a second, {len(total.failures)} failures, {slowest}",
                    flush=True,
                )
    return _report(total, peaks)


def _report(total: Tally, peaks: dict[int, list[int]]) -> int:
    for (kind, found), count in sorted(total.answers.items(), key=lambda item: (item[0][0], -item[1])):
        print(f"{kind:12} {count:9,}  {found}")
    growths = [of[-1] - of[len(of) // 2] for of in peaks.values()]
    peak = max(of[-1] for of in peaks.values())
    print(f"peak memory {peak / 2**20:.0f} MiB, growth in the second half {max(growths) / 2**20:.0f} MiB")
    for what, count in Counter(failure.what for failure in total.failures).most_common(50):
        print(f"{count:9,}  {what}")
    return int(bool(total.failures) or max(growths) > MOST_GROWTH)


if __name__ == "__main__":
    sys.exit(main())
