"""The pack of hard cases as it is stored: `cases.toml` says what they are, `rays.npz` holds rays and answers.

`undecided.toml` says how many rays of each family may be left undecided: a table for each precision and method.

Rays of all cases stand one after another; a case's number of rays says which are its own. The rays carry the digest of
the cases that they belong to: two files that were not written together are no pack.
"""

from __future__ import annotations

import hashlib
import tomllib
import zlib
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, field, replace
from importlib.resources import files
from io import BytesIO
from pathlib import Path
from typing import Any
from zipfile import BadZipFile

import numpy as np
from numpy.typing import NDArray

from lenscl.errors import LensclError
from lenscl.hardcases.case import LEVELS, ULPS, Answers, Case, Expected, Moved
from lenscl.imaging.atomic import whole_file

_FOLDER = Path(str(files("lenscl.hardcases"))) / "pack"
_CASES, _RAYS, _UNDECIDED = "cases.toml", "rays.npz", "undecided.toml"
_WORDS = ("name", "family", "why", "scene", "equals", "refused", "proved_as")
_FLAGS = ("is_exact", "starts_exactly", "keeps_contact", "has_gaps", "counts_lengths")
_GIVEN = ("origins", "directions", "lacks_values")
_ANSWERS = ("status", "events", "st")
_LENGTHS = ("lengths", *(f"lengths.{level}" for level in LEVELS))


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Pack:
    """All cases, and what is true of the rays of each.

    Attributes
    ----------
    cases : tuple of Case
    expected : mapping of str to Expected
        By case, but for those that are refused.
    most_undecided : mapping of str to mapping of str to mapping of str to int
        By precision, method and family: how many rays are left undecided on a device that has double precision. More
        are more than expected. A family that is not named has none. Of a method that is not named nothing is expected.
    """

    cases: tuple[Case, ...]
    expected: Mapping[str, Expected]
    most_undecided: Mapping[str, Mapping[str, Mapping[str, int]]] = field(default_factory=dict)

    def having(self, texts: Collection[str]) -> Pack:
        """Return the cases whose names contain any of some texts, and those that they are compared with.

        Without a text it is all cases.
        """
        named = {case.name for case in self.cases if not texts or any(text in case.name for text in texts)}
        named |= {case.equals for case in self.cases if case.name in named and case.equals}
        return replace(self, cases=tuple(case for case in self.cases if case.name in named))


def load_pack() -> Pack:
    """Read the pack that comes with the program.

    Raises
    ------
    LensclError
        If it is not there, or not whole.
    """
    try:
        text = (_FOLDER / _CASES).read_bytes()
        with (_FOLDER / _RAYS).open("rb") as stream, np.load(stream) as stored:
            arrays = {name: stored[name] for name in stored.files}
        if not np.array_equal(arrays["cases"], _digest(text)):
            raise ValueError(f"{_RAYS} belongs to other cases than those in {_CASES}")
        if arrays["ulps"] != ULPS:
            raise ValueError(f"{_RAYS} was made by moves of {arrays['ulps']} roundings, not of {ULPS}")
        rows = tomllib.loads(text.decode())["case"]
    except (OSError, EOFError, KeyError, ValueError, BadZipFile, zlib.error) as error:
        raise _unreadable(error) from error
    given = _split(arrays, _GIVEN, arrays["given"])
    answers = _split(arrays, (*_ANSWERS, "reasons"), arrays["rays"])
    moved = {level: _moved(level, arrays) for level in LEVELS}
    lengths = _split(arrays, _LENGTHS, arrays["lengths_of"])
    cases, expected = [], {}
    for number, row in enumerate(rows):
        rays: Mapping[str, Any] = given[number] if arrays["given"][number] else {}
        if "counts_from" in row:
            row["counts_from"] = tuple(row["counts_from"])
        case = Case(**row, **rays)
        cases.append(case)
        if not case.refused:
            reasons = answers[number].pop("reasons")
            expected[case.name] = Expected(
                answers=Answers(**answers[number]),
                moved={level: moved[level][number] for level in LEVELS},
                reasons=reasons,
            )
            if case.counts_lengths:
                expected[case.name] = _with_lengths(expected[case.name], lengths[number])
    return Pack(cases=tuple(cases), expected=expected, most_undecided=most_undecided())


def most_undecided() -> dict[str, dict[str, dict[str, int]]]:
    """Return how many rays of each family may be left undecided, by precision and method.

    Raises
    ------
    LensclError
        If that is not to be read.
    """
    try:
        return tomllib.loads((_FOLDER / _UNDECIDED).read_text(encoding="utf-8"))
    except (OSError, ValueError) as error:
        raise _unreadable(error) from error


def write_pack(pack: Pack) -> None:
    """Write the pack down in the place of the one that is there."""
    import tomli_w

    rows = [
        {name: getattr(case, name) for name in _WORDS if getattr(case, name)}
        | {name: True for name in _FLAGS if getattr(case, name)}
        | ({} if case.edition == 1 else {"edition": case.edition})
        | ({} if case.counts_from is None else {"counts_from": list(case.counts_from)})
        for case in pack.cases
    ]
    expected = [pack.expected.get(case.name) for case in pack.cases]
    proved = [each for each in expected if each is not None]
    given = [case for case in pack.cases if case.origins is not None]
    text = tomli_w.dumps({"case": rows}, multiline_strings=True).encode()
    arrays: dict[str, NDArray[Any]] = {
        "cases": _digest(text),
        "ulps": np.array(ULPS),
        "given": np.array([0 if case.origins is None else len(case.origins) for case in pack.cases], np.int32),
        "rays": np.array([0 if each is None else len(each.answers.status) for each in expected], np.int32),
        "origins": np.concatenate([case.origins for case in given if case.origins is not None]),
        "directions": np.concatenate([case.directions for case in given if case.directions is not None]),
        "lacks_values": np.concatenate([_lacking(case) for case in given]),
    }
    arrays |= _joined("", [each.answers for each in proved])
    arrays["reasons"] = np.concatenate([_reasons(each) for each in proved])
    lengths = [_lengths(each) for each in expected]
    arrays["lengths_of"] = np.array([each.shape[1] for each in lengths], np.int32)
    arrays |= dict(zip(_LENGTHS, np.concatenate(lengths, axis=1), strict=True))
    for level in LEVELS:
        moved = [each.moved[level] for each in proved]
        arrays |= {
            f"{level}.spread": np.concatenate([each.spread for each in moved]).astype(np.float32),
            f"{level}.is_stable": np.concatenate([each.is_stable for each in moved]),
            f"{level}.ray": np.concatenate([each.ray for each in moved]),
            f"{level}.beside": np.array(
                [0 if each is None else len(each.moved[level].ray) for each in expected], np.int32
            ),
        }
        arrays |= _joined(f"{level}.beside.", [each.beside for each in moved])
    stream = BytesIO()
    np.savez_compressed(stream, **arrays)  # type: ignore[arg-type] # its second parameter is no array
    _FOLDER.mkdir(exist_ok=True)
    undecided = tomli_w.dumps(pack.most_undecided).encode()
    for name, content in ((_CASES, text), (_RAYS, stream.getvalue()), (_UNDECIDED, undecided)):
        with whole_file(_FOLDER / name, len(content)) as temporary:
            temporary.write_bytes(content)


def _unreadable(error: Exception) -> LensclError:
    return LensclError(
        f"{_FOLDER}: the pack of hard cases cannot be read ({error}); install lenscl again, "
        "or make the pack by bench/make_hard_cases.py"
    )


def _digest(text: bytes) -> NDArray[np.uint8]:
    return np.frombuffer(hashlib.sha256(text).digest(), np.uint8)


def _lacking(case: Case) -> NDArray[np.bool_]:
    count = 0 if case.origins is None else len(case.origins)
    return np.zeros(count, np.bool_) if case.lacks_values is None else case.lacks_values


def _reasons(expected: Expected) -> NDArray[np.uint8]:
    count = len(expected.answers.status)
    return np.zeros(count, np.uint8) if expected.reasons is None else expected.reasons


def _lengths(expected: Expected | None) -> NDArray[np.float64]:
    """Return the rows of `_LENGTHS` of a case, one number after another; of none where nothing is counted."""
    if expected is None or expected.lengths is None:
        return np.zeros((len(_LENGTHS), 0))
    spreads = [expected.moved[level].length_spread for level in LEVELS]
    return np.stack([each.ravel() for each in (expected.lengths, *spreads) if each is not None])


def _with_lengths(expected: Expected, stored: Mapping[str, NDArray[np.float64]]) -> Expected:
    lengths, *spreads = (each.reshape(len(expected.answers.status), -1) for each in stored.values())
    moved = {
        level: replace(expected.moved[level], length_spread=spread)
        for level, spread in zip(LEVELS, spreads, strict=True)
    }
    return replace(expected, lengths=lengths, moved=moved)


def _joined(prefix: str, answers: Sequence[Answers]) -> dict[str, NDArray[Any]]:
    return {f"{prefix}{name}": np.concatenate([getattr(each, name) for each in answers]) for name in _ANSWERS}


def _moved(level: str, arrays: Mapping[str, NDArray[Any]]) -> list[Moved]:
    own = _split(arrays, (f"{level}.spread", f"{level}.is_stable"), arrays["rays"])
    beside = _split(arrays, [f"{level}.beside.{name}" for name in _ANSWERS], arrays[f"{level}.beside"])
    rays = _split(arrays, (f"{level}.ray",), arrays[f"{level}.beside"])
    return [
        Moved(
            spread=mine["spread"].astype(np.float64),
            is_stable=mine["is_stable"],
            beside=Answers(**others),
            ray=which["ray"],
        )
        for mine, others, which in zip(own, beside, rays, strict=True)
    ]


def _split(
    arrays: Mapping[str, NDArray[Any]], names: Sequence[str], counts: NDArray[np.int32]
) -> list[dict[str, NDArray[Any]]]:
    """Return what belongs to each case, by the last part of its name."""
    ends = np.cumsum(counts)
    return [
        {name.rpartition(".")[2]: arrays[name][end - count : end] for name in names}
        for end, count in zip(ends, counts, strict=True)
    ]
