"""What to say of a text that is not TOML: which line, what stands there, and how it is written.

tomllib tells a reason and a place. The reason is kept; where the place shows what was meant (a table begun twice, a
decimal comma, text without quotation marks), that is said as well.
"""

from __future__ import annotations

import math
import re
from collections.abc import Iterator

from lenscl.config.tables import LISTS, ONLY_ONE

_LONGEST_LINE = 100
_LONGEST_READ = 10_000  # characters of the line
_LONGEST_REASON = 200
_PLACE = re.compile(r" *\(at line (\d+), column (\d+)\)$|\(at end of document\)$")
_KEY = r"(?:[\w-]+|\"[^\"]*\"|'[^']*')"
_HEADER = re.compile(rf"\s*(\[\[?)\s*({_KEY}(?:\s*\.\s*{_KEY})*)\s*(\]\]?)\s*(?:#.*)?")
_PAIR = re.compile(rf"\s*({_KEY}(?:\s*\.\s*{_KEY})*)\s*=(.*)")
_CONSTANTS = {"pi": math.pi, "tau": math.tau, "e": math.e}
_BARE_POINT = r"(?<![\d.])\.\d|\d\.(?!\d)"  # of a number without digits before or behind it
_SMART = "“”„‟‘’‚‛«»＂"


def toml_problem(text: str, error: ValueError, where: str) -> str:
    """Return the problem of a text that tomllib refuses.

    Parameters
    ----------
    text : str
        The whole text.
    error : ValueError
        What tomllib raised.
    where : str
        The file, or what else the message leads with.
    """
    reason = str(error)[-2 * _LONGEST_REASON :]
    place = _PLACE.search(reason)
    reason = (reason[: place.start()] if place else reason)[:_LONGEST_REASON].strip()
    lines = text.replace("\r\n", "\n").split("\n")
    if place is None or place[1] is None:
        end = " at the end; a text or a list that is opened is never closed" if place else ""
        return f"{where}: is not TOML: {reason}{end}"
    number, column = int(place[1]), int(place[2])
    line = lines[number - 1][:_LONGEST_READ] if number <= len(lines) else ""
    if reason.startswith(("Cannot declare", "Cannot overwrite", "Cannot mutate", "Cannot redefine")):
        twice = _twice(lines, number)
        if twice is not None:
            return f"{where}: line {number}: {twice}"
    advice = _advice(line, column, reason)
    shown = f"\n  {_shown(line)}" if line.strip() else ""
    return f"{where}: is not TOML: line {number}, column {column}: {reason}{f'; {advice}' if advice else ''}{shown}"


def _twice(lines: list[str], number: int) -> str | None:
    """Return what is said of a table or a key that is written a second time, None where that is not seen."""
    if (table := _header(lines[number - 1])) is not None:
        return _table_twice(lines, number, table)
    pair = _PAIR.fullmatch(lines[number - 1])
    if pair is None:
        return None
    key, first = _plain(pair[1]), None
    for earlier, line in _opened(lines[: number - 1]):
        if _header(line) is not None:
            first = None
        elif (other := _PAIR.fullmatch(line)) is not None and _plain(other[1]) == key:
            first = earlier
    if first is None:
        return None
    return f"{_named(key)} is given a second time in its table, first in line {first}; keep one of the two"


def _table_twice(lines: list[str], number: int, key: str) -> str | None:
    earlier = next((place for place, line in _opened(lines[: number - 1]) if _begins(line, key)), None)
    if earlier is None:
        return None
    if key in LISTS:
        return f"the table {_named(key)} is written [[{key}]], with double brackets, each time; see line {earlier}, too"
    return f"the table [{_named(key)}] is begun a second time, first in line {earlier}; {only_one(key)}"


def _begins(line: str, key: str) -> bool:
    """Return whether a line begins a table, by its header or by a key that leads into it."""
    if (table := _header(line)) is not None:
        return table == key
    pair = _PAIR.fullmatch(line)
    return pair is not None and _plain(pair[1]).startswith(f"{key}.")


def _header(line: str) -> str | None:
    """Return the name of the table that a line begins, None where it begins none."""
    found = _HEADER.fullmatch(line)
    return _plain(found[2]) if found is not None and len(found[1]) == len(found[3]) else None


def only_one(table: str) -> str:
    """Return what to do where a table is written more than once that a study has once."""
    return ONLY_ONE.get(table, "write all of its keys in one")


def _opened(lines: list[str]) -> Iterator[tuple[int, str]]:
    """Yield lines by their numbers, but for those within a text of several lines."""
    within = ""
    for number, line in enumerate(lines, 1):
        marks = re.findall(r"\"\"\"|'''", line)
        if not within:
            yield number, line
        for mark in marks:
            within = "" if within == mark else within or mark


def _plain(key: str) -> str:
    return ".".join(part.strip().strip("\"'") for part in re.findall(_KEY, key))


def _named(key: str) -> str:
    return key.encode("unicode_escape").decode("ascii")[:_LONGEST_LINE]


def _shown(line: str) -> str:
    line = line.strip()
    line = line if len(line) <= _LONGEST_LINE else line[: _LONGEST_LINE - 3] + "..."
    return "".join(c if c.isprintable() else " " if c == "\t" else c.encode("unicode_escape").decode() for c in line)


def _advice(line: str, column: int, reason: str) -> str:
    """Return how a line is written that tomllib refuses; empty where nothing is known of it."""
    stripped = line.strip()
    if "Unclosed inline table" in reason:
        return "a table in { } stands on one line"
    pair = _PAIR.fullmatch(line)
    if reason == "Unclosed array" and pair is not None and pair[2].partition("#")[0].strip().endswith("]"):
        if re.search(_BARE_POINT, pair[2]):
            return "a number has digits on both sides of its point, such as 0.5 or 2.0"
        return "the values of a list are separated by commas"
    if reason == "Unclosed array" or (reason.startswith("Invalid value") and _header(line) is not None):
        return "a list [ that is opened above is never closed by ]"
    if re.match(r"(//|;|--|/\*|%)", stripped):
        return "a remark begins with #"
    if stripped.startswith("{"):
        return "this looks like JSON; a study has tables, such as [source] and [[lens]], and keys, such as n = 1.5"
    if stripped.startswith("[") and "=" not in stripped and _header(line) is None:
        return "a table is written [source], a lens [[lens]], with as many brackets behind the name as before it"
    if any(mark in line for mark in _SMART):
        return 'quotation marks are the straight ones, "..."'
    if reason == "Invalid statement" and line[column - 1 : column].isalpha():
        return "a key is of the letters a to z, digits, _ and -; other letters and signs stand in quotation marks"
    if pair is None:
        if re.match(rf"\s*{_KEY}\s*:", line):
            return "a key and its value are joined by =, such as n = 1.5"
        if re.fullmatch(r"\s*[\w-]+(\s+[\w-]+)+\s*=.*", line):
            return "a key with spaces stands in quotation marks"
        return ""
    return _value_advice(pair[1].strip(), pair[2].partition("#")[0].strip(), reason)


def _value_advice(key: str, value: str, reason: str) -> str:
    """Return how a value is written."""
    if re.search(r"\s(//|--|;|%)(\s|$)", value) and value[0] not in "\"'":
        return "a remark begins with #"
    if value in _CONSTANTS:
        return f"nothing is computed here: write the number itself, {key} = {_CONSTANTS[value]!r}"
    if not value:
        return f"write a value behind {_named(key)} =, or leave the key out"
    if value.endswith(";"):
        return "a line ends without ;"
    if value.startswith("("):
        return f"a list stands in square brackets, {key} = [...]"
    if "Unescaped" in reason or "escape" in reason or (value[0] in "\"'" and "\\" in value):
        return "in \"...\" a backslash is written \\\\; or write '...', in which it stands for itself, or / in a path"
    if re.fullmatch(r"[+-]?\d+,\d+", value):
        return f"a decimal is written with a point, {key} = {value.replace(',', '.')}"
    if value in ("True", "False", "TRUE", "FALSE"):
        return f"write {value.lower()}"
    if value.lower() in ("null", "none", "nil", "~"):
        return f"there is no {value}; leave the key out"
    if value.lower() in ("yes", "no", "on", "off"):
        return "write true or false"
    if value.lower() in ("infinity", "+infinity", "-infinity"):
        return "write inf"
    if re.fullmatch(r"[+-]?(\d+\.|\.\d+)([eE][+-]?\d+)?", value):
        return "a number has digits on both sides of its point, such as 0.5 or 2.0"
    if re.fullmatch(r"[+-]?0\d+(\.\d+)?", value):
        return "a number begins with no further zeros"
    if value[0] in "[{" and re.search(_BARE_POINT, value):
        return "a number has digits on both sides of its point, such as 0.5 or 2.0"
    if value[0] in "[{" and value.count("[") + value.count("{") > value.count("]") + value.count("}"):
        return "the bracket is never closed"
    if value[0] in "\"'" and value.count(value[0]) == 1:
        return f"the text is never closed by {value[0]}"
    if value[0] == "[" and ";" in value:
        return "the values of a list are separated by commas"
    if re.fullmatch(r"[+-]?[\d.eE+-]+(\s*,\s*[+-]?[\d.eE+-]+)+,?", value):
        return f"several values stand in square brackets, {key} = [{_shown(value)}]"
    if re.match(r"[A-Za-z_(\\/.~]", value) or (key == "surface" and value[0] not in "\"'[{"):
        return f'a text stands in quotation marks, {key} = "{_shown(value)}"'
    if re.fullmatch(r"[\d.eE\s()]+[*/^+-][\d.eE\s()*/^+-]+", value):
        return (
            "nothing is computed here: write the number itself; only an expression of a surface, in quotation marks, is"
        )
    if re.match(r"[+-]?[\d.]+(?:[eE][+-]?\d+)?\s*[^\s\d.,]", value):
        return "a number stands alone: lengths are in scene units, angles in degrees, wavelengths in nm"
    return ""
