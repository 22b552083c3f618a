"""Words for what is wrong: values shortened for a message, nearest known keys, pydantic's findings in our terms."""

from __future__ import annotations

import difflib
from collections.abc import Callable, Iterable
from typing import Any, TypeVar

from pydantic import BaseModel, ValidationError

from lenscl.errors import StudyError

Report = Callable[[str], None]  # takes one problem, led by its key
_Model = TypeVar("_Model", bound=BaseModel)

_LONGEST_VALUE = 60  # characters of a value that a message repeats
_LONGEST_PATH = 400
_LONGEST_LIST = 8
_DEEPEST_VALUE = 3
PARTS = "study_parts"  # the type of an error that has the problems of a table, each led by its key in that
MOST_PROBLEMS = 100  # a message is for reading: of a hostile file the first hundred faults are enough


def short(value: object, depth: int = 0) -> str:
    """Spell a value of a study for a message, in TOML's manner, never longer than a line."""
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, int) and abs(value) >= 10**20:
        return f"a whole number of about {int(value.bit_length() * 0.30103) + 1} digits"
    if isinstance(value, str):
        text = value if len(value) <= _LONGEST_VALUE else value[: _LONGEST_VALUE - 3] + "..."
        return '"' + _printable(text).replace('"', '\\"') + '"'
    if isinstance(value, dict):
        return "a table" if value else "an empty table"
    if isinstance(value, list | tuple):
        if len(value) > _LONGEST_LIST or depth >= _DEEPEST_VALUE:
            return f"a list of {len(value)} values"
        text = "[" + ", ".join(short(entry, depth + 1) for entry in value) + "]"
        return text if len(text) <= 2 * _LONGEST_VALUE else f"a list of {len(value)} values"
    text = repr(value) if isinstance(value, int | float) else str(value)
    return text if len(text) <= _LONGEST_VALUE else text[: _LONGEST_VALUE - 3] + "..."


def _printable(text: str) -> str:
    """Return a text with what a terminal would act on, and backslashes, escaped; letters of all scripts are kept."""
    return "".join(c if c.isprintable() and c != "\\" else c.encode("unicode_escape").decode("ascii") for c in text)


def nearest(word: str, known: Iterable[str]) -> str:
    """Return `; did you mean "..."?` for the nearest known word, else the list of them."""
    words = list(known)
    near = difflib.get_close_matches(word[:_LONGEST_VALUE], words, n=1, cutoff=0.6)
    if not near:  # a difference in case alone is not near enough for short words
        near = [candidate for candidate in words if candidate.casefold() == word.casefold()][:1]
    if near:
        return f'; did you mean "{near[0]}"?'
    return f"; known are {', '.join(words)}" if 0 < len(words) <= 24 else ""


def key_text(key: str) -> str:
    """Return a key as a message leads with it: shortened, with nothing a terminal would act on."""
    text = short(key)[1:-1]
    return text if text else '""'


def file_text(path: object) -> str:
    """Return a file's name as a message leads with it: whole unless absurd, with nothing a terminal would act on."""
    text = str(path).encode("unicode_escape").decode("ascii") if not str(path).isprintable() else str(path)
    return text if len(text) <= _LONGEST_PATH else "..." + text[-_LONGEST_PATH:]


def unknown_key(at: str, key: str, known: Iterable[str]) -> str:
    """Return the problem of a key that does not exist."""
    where = f"{at}.{key_text(key)}" if at else key_text(key)
    return f"{where}: unknown key{nearest(key, known)}"


def from_pydantic(error: ValidationError, at: str, known: Iterable[str]) -> list[str]:
    """Return the findings of one table, each led by its key."""
    found = []
    for item in error.errors(include_url=False, include_input=False)[:MOST_PROBLEMS]:
        loc = [str(part) for part in item["loc"]]
        where = ".".join([at, *(key_text(part) for part in loc)]) if at else ".".join(loc)
        match item["type"]:
            case "extra_forbidden":
                found.append(unknown_key(".".join([part for part in [at, *loc[:-1]] if part]), loc[-1], known))
            case "missing":
                found.append(f"{where}: is required")
            case _ if item["type"] == PARTS:
                found += [f"{where}.{problem}" for problem in item["ctx"]["problems"]]
            case "model_type" | "dict_type":
                found.append(f"{where}: must be a table")
            case _:
                found.append(f"{where}: {item['msg']}")
    return found


def validated(model: type[_Model], table: dict[str, Any], at: str, report: Report) -> _Model | None:
    """Return a table as its model reads it, or None after its problems were reported."""
    try:
        return model.model_validate(table)
    except ValidationError as error:
        for problem in from_pydantic(error, at, model.model_fields):
            report(problem)
    return None


def study_error(problems: Iterable[str]) -> StudyError:
    """Return the error of all problems, each once, in their order."""
    once = list(dict.fromkeys(problems))
    if len(once) > MOST_PROBLEMS:
        once = [*once[:MOST_PROBLEMS], "and more problems; mend these first"]
    return StudyError(once)


def as_plain(value: Any) -> Any:
    """Return NumPy scalars and arrays as Python numbers and lists, everything else as it is."""
    return value.tolist() if hasattr(value, "tolist") else value
