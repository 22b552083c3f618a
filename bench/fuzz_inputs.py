"""Make hostile inputs of every kind that a user can write: expressions, studies, files of bytes and settings.

A seed and a number give the same input on any machine. Half of the inputs are nearly valid, for what is refused at the
first glance tests nothing behind it: shipped studies with some of their values changed, and expressions of the grammar.
The words come from the program's own tables, so that what is added there is tried here.
"""

from __future__ import annotations

import copy
import datetime
import random
import re
import tomllib
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import tomli_w
from fuzz_expressions import NAMES, PART, Expressions

from lenscl.config.tables import (
    FORMATS,
    MODES,
    SCENE_TABLES,
    TOP_KEYS,
    LensTable,
    OutputTable,
    SweepTable,
)
from lenscl.effects import EFFECTS
from lenscl.expr import FUNCTIONS
from lenscl.lenses import catalogue
from lenscl.materials import CATALOGUE
from lenscl.methods import METHODS

CONFIGS = Path(__file__).resolve().parent.parent / "configs"
BOX = [[-2.0, -2.0, -2.0], [2.0, 2.0, 2.0]]
_MARKS = (
    *("[", "]", "[[", "]]", "{", "}", '"', "'", '"""', "=", ",", ".", "#", "\n", "\r\n", "\t", "\\", "\x7f", "\0"),
    "\ufeff",
)
_LINES = ("[sweep]\n", "[[lens]]\n", "0x1f", "1e5", "1979-05-27T07:32:00Z", "true", "[[sweep.zip]]\n", "a.b.c = 1\n")
_EXTRA = """
surface = "x**2 + y**2 + z**2 - k + 0.1 * sin(3 * x)"
k = 0.5
bounds = [[-1, -1, -1], [1, 1, 1]]
"""
_MORE_STUDIES = (
    """
source = { kind = "parallel", direction = [0, 0.1, -1] }
film = { corner = [-1, 1, 2.5], right = [2, 0, 0], down = [0, -2, 0], size = [9, 7], scale = 0.5 }
picture = { centre = [0, 0, -2.5], right = [6, 0, 0], down = [0, -6, 0], images = "pictures/*", encoding = "linear" }
medium = { n = { cauchy = [1.3, 0.004] } }
effects = { total_reflection = "end", fresnel = false }
numerics = { accuracy = "0.05 px", max_events = 9 }
[[lens]]
name = "front"
surface = "biconvex"
R1 = 1.5
R2 = 1.2
thickness = 0.6
diameter = 1.4
n = "BK7"
[[lens]]
name = "back"
surface = "x**4 + y**4 + z**4 - k"
k = 0.4
bounds = [[-1, -1, -1], [1, 1, 1]]
n = { sellmeier = [1.0, 0.2, 0.006, 0.02] }
centre = [0, 0, -2.5]
rotate = [10, 20, 30]
[sweep]
mode = "latin"
samples = 5
seed = 3
[sweep.axes]
"lens.back.k" = { min = 0.2, max = 0.6 }
"lens.front.n" = { min = 1.3, max = 2.0, scale = "log" }
""",
    """
[source]
at = [0, 0, 4]
[film]
centre = [0, 0, 2.5]
right = [2, 0, 0]
down = [0, -2, 0]
size = [8, 6]
[picture]
centre = [0, 0, -2.5]
right = [6, 0, 0]
down = [0, -6, 0]
[[lens]]
n = { table = [[400, 1.6], [600, 1.5], [700, 1.45]] }
stretch = [1, -0.8, 0.5]
"""
    + _EXTRA
    + """
[numerics]
method = "march"
precision = "mixed"
step = 0.05
[sweep]
max_points = 500
[sweep.axes]
"lens.k" = { linspace = [0.2, 0.6, 4] }
"film.size.rows" = [3, 6]
"numerics.step" = { logspace = [1e-3, 1e-1, 3] }
[[sweep.zip]]
"lens.stretch.x" = { range = [0.5, 1.0, 0.25] }
"lens.n" = [1.33, "diamond", 1.5]
[[sweep.exclude]]
"lens.k" = 0.2
[[sweep.include]]
"lens.surface" = "torus"
"lens.r" = 0.2
""",
)
STUDIES = (*(path.read_text() for path in sorted(CONFIGS.rglob("*.toml"))), *_MORE_STUDIES)

_NUMBERS = (
    *(0, 1, -1, 2, 3, 255, 256, 1024, 2**31, 2**63, 10**20, 10**400, -(10**40)),
    *(0.0, -0.0, 0.5, 1.5, -2.0, 1e-3, 1e-12, 9e-13, 1e-300, 5e-324, 1e6, 1e12, 1.1e12, 1e30, 1e300),
    *(float("inf"), float("-inf"), float("nan")),
)
_TEXTS = (
    *("", " ", "x", "1/0", "0.05 px", "1e-9", "-1 px", "1e999", "px", "lens.r", "a*", "[a]*", "*/*"),
    *(
        "pictures/*",
        "\0",
        "nan",
        "None",
        "__import__('os')",
        "x" * 2000,
        "é",
        "\u202e",
        "\x1b[31m",
        "point",
        "parallel",
        "grid",
        "linear",
    ),
)
_AXES = ("linspace", "logspace", "range", "min", "max", "scale")


def _words() -> tuple[str, ...]:
    """Return every word that a study may hold: keys, names, choices."""
    tables = (*SCENE_TABLES.values(), LensTable, SweepTable, OutputTable)
    found = [*TOP_KEYS, *(key for table in tables for key in table.model_fields), *_AXES, *FORMATS, *MODES]
    choices = (choice for effect in EFFECTS.values() for choice in effect.choices)
    found += [*EFFECTS, *(choice for choice in choices if isinstance(choice, str))]
    found += [*catalogue(), *(each.name for row in catalogue().values() for each in row.parameters)]
    found += [*CATALOGUE, *METHODS, *sorted(FUNCTIONS), *NAMES]
    found += ["single", "double", "mixed", "exact", "paraxial", "auto"]
    return tuple(dict.fromkeys(found))


WORDS = _words()
_DOCUMENTS = tuple(tomllib.loads(text) for text in STUDIES)
_TOKEN = re.compile(r'"[^"\n]*"|[\w.+-]+|\s+|.', re.DOTALL)


@dataclass(frozen=True, slots=True)
class Input:
    """What is fed to the program: text, or a file's bytes; a setting's text goes to a study by number."""

    kind: str  # "expression", "study", "file" or "setting"
    content: str | bytes
    study: int = 0


def made(seed: int, number: int) -> Input:
    """Return the input of a seed and a number."""
    return Maker(random.Random(f"{seed} {number}")).input()


class Maker(Expressions):
    """Makes inputs of every kind from a source of random numbers."""

    def input(self) -> Input:
        """Return an input of any kind."""
        kind = self.rng.choices(("expression", "study", "file", "setting"), (50, 32, 8, 10))[0]
        match kind:
            case "expression":
                return Input(kind, self.expression())
            case "study":
                return Input(kind, self.study())
            case "file":
                return Input(kind, self.file())
            case _:
                return Input(kind, self.setting(), self.rng.randrange(len(STUDIES)))

    def study(self) -> str:
        """Return the text of a study: values changed, text damaged, or an expression put in."""
        way = self.rng.random()
        if way < 0.55:
            return tomli_w.dumps(self._changed(self.rng.randint(1, 4)))
        if way < 0.75:
            return tomli_w.dumps(self._with_expression())
        return self._damaged(self.rng.choice(STUDIES), _TOKEN, self._token)

    def file(self) -> bytes:
        """Return the bytes of a file: a study's with some of them changed, or any."""
        rng = self.rng
        if rng.random() < 0.2:
            return rng.randbytes(rng.randint(0, 400))
        data = bytearray(rng.choice(STUDIES).encode())
        for _ in range(rng.randint(1, 8)):
            place = rng.randrange(len(data) + 1)
            match rng.randrange(4):
                case 0:
                    data[place:place] = rng.randbytes(rng.randint(1, 4))
                case 1:
                    del data[place : place + rng.randint(1, 40)]
                case 2:
                    data[place : place + 1] = bytes([rng.randrange(256)])
                case _:
                    piece = bytes(data[place : place + rng.randint(1, 200)])
                    data[place:place] = piece * rng.randint(1, 5)
        return bytes(data)

    def setting(self) -> str:
        """Return a text as `--set` takes it, KEY=VALUE more often than not."""
        rng = self.rng
        if rng.random() < 0.1:
            return self._damaged("lens.r = 0.2", _TOKEN, self._token)
        value = tomli_w.dumps({"v": self._value(2)}).removeprefix("v = ") if rng.random() < 0.7 else self.expression()
        return f"{self._key()}={value.strip()}"

    def _with_expression(self) -> dict[str, Any]:
        """Return a study whose lens is an expression, with its parameters and bounds."""
        rng = self.rng
        document = copy.deepcopy(rng.choice(_DOCUMENTS))
        lens = {"surface": self.expression(), "n": 1.5, "bounds": copy.deepcopy(BOX)}
        for name in (name for name in NAMES[3:] if name in lens["surface"]):
            lens[name] = rng.choice((0.1, 0.5, 1.0, -1.0, 0.0, 1e-3, 1e6, 1e300))
        document["lens"] = [lens]
        document.pop("sweep", None)
        if rng.random() < 0.5:
            document["sweep"] = {"axes": {"lens.n": [1.2, 1.5], f"lens.{rng.choice(NAMES[3:])}": self._axis()}}
        for _ in range(rng.choice((0, 0, 1))):
            self._change(document)
        return document

    def _changed(self, changes: int) -> dict[str, Any]:
        document = copy.deepcopy(self.rng.choice(_DOCUMENTS))
        for _ in range(changes):
            self._change(document)
        return document

    def _change(self, document: dict[str, Any]) -> None:
        """Change a document in one place."""
        rng = self.rng
        places = list(_places(document))
        table, key = rng.choice(places) if places else (document, "title")
        match rng.randrange(9):
            case 0:
                table[key] = self._value(3)
            case 1 | 2 if places:
                table[key] = self._like(table[key])
            case 3 if places:
                del table[key]
            case 4 if isinstance(table, dict) and places:
                table[rng.choice((*WORDS, f"{key}s", str(key).upper(), ""))] = table.pop(key)
            case 5 if isinstance(table, list) and table:
                table.insert(rng.randint(0, len(table)), copy.deepcopy(rng.choice(table)))
            case 6 if places:
                other, there = rng.choice(places)
                value = copy.deepcopy(other[there])
                table[key] = value
            case 7:
                _table(document, "sweep.axes")[self._key()] = self._axis()
            case 8:
                _table(document, rng.choice((*TOP_KEYS, "sweep.axes")))[rng.choice(WORDS)] = self._value(2)
            case _:
                entry = {self._key(): self._value(1) for _ in range(rng.randint(0, 2))}
                sweep, name = _table(document, "sweep"), rng.choice(("zip", "exclude", "include"))
                before = sweep.get(name)
                sweep[name] = [*(before if isinstance(before, list) else []), entry]

    def _like(self, value: Any) -> Any:
        """Return another value of the same type."""
        rng = self.rng
        if isinstance(value, bool):
            return not value
        if isinstance(value, int | float):
            near = (value + 1, -value, value / 3, value * 1e6) if abs(value) < 1e300 else ()
            return rng.choice((*near, *rng.sample(_NUMBERS, 3)))
        if isinstance(value, str):
            return rng.choice((rng.choice(WORDS), rng.choice(_TEXTS), self._damaged(value, PART, self._part)))
        if isinstance(value, list) and value:
            changed = list(value)
            changed[rng.randrange(len(changed))] = self._like(rng.choice(value))
            return changed
        return self._value(1)

    def _value(self, depth: int) -> Any:
        rng = self.rng
        match rng.randrange(12 if depth else 8):
            case 0 | 1 | 2:
                return rng.choice(_NUMBERS)
            case 3 | 4:
                return rng.choice(WORDS)
            case 5:
                return rng.choice(_TEXTS)
            case 6:
                return rng.choice((True, False, datetime.date(2000, 1, 2), datetime.time(3, 4), [], {}))
            case 7:
                return self.expression() if rng.random() < 0.3 else [rng.choice(_NUMBERS) for _ in range(3)]
            case 8:
                return [self._value(depth - 1) for _ in range(rng.choice((1, 2, 3, 3, 3, 4, 40)))]
            case 9:
                return {rng.choice(WORDS): self._value(depth - 1) for _ in range(rng.randint(1, 3))}
            case 10:
                return self._axis()
            case _:
                value = self._value(depth - 1)
                return [value] * rng.choice((2, 3, 100))

    def _axis(self) -> Any:
        rng = self.rng
        numbers = [rng.choice((*_NUMBERS, 0.1, 0.3, 2, 3, 4, 5)) for _ in range(3)]
        made = (numbers, [0.1, 0.2], {"linspace": numbers}, {"logspace": numbers}, {"range": numbers})
        spans = ({"min": numbers[0], "max": numbers[1]}, {"min": 0.1, "max": 0.5, "scale": "log"})
        right = ({"linspace": [0.1, 0.5, 3]}, {"range": [0.1, 0.5, 0.1]})
        return rng.choice((*made, *spans, *right, [rng.choice(WORDS), self._value(1)], self._value(1)))

    def _key(self) -> str:
        rng = self.rng
        tables = {"source": "at", "film": "size", "picture": "right", "numerics": "step", "medium": "n", "lens": "r"}
        name = rng.choice((*tables, "lens", "lens", "lens"))
        last = rng.choice((tables[name], rng.choice(WORDS), "centre", "stretch", "surface", "n", "rotate", "k"))
        middle = rng.choice(("", "", "", "", "front.", "back."))
        end = rng.choice(("", "", "", ".x", ".y", ".rows", ".columns", ".w"))
        whole = f"{name}.{middle}{last}{end}"
        return rng.choice((whole, f"{name}.{last}", f"sweep.{last}", "title", rng.choice(_TEXTS)))

    def _token(self) -> str:
        rng = self.rng
        some = (rng.choice(_MARKS), rng.choice(WORDS), str(rng.choice(_NUMBERS)), rng.choice(_TEXTS))
        return rng.choice((*some, *_LINES))


def _places(container: Any) -> Iterator[tuple[Any, Any]]:
    """Yield every table or list of a document with each of its keys or indices."""
    for key, value in container.items() if isinstance(container, dict) else enumerate(container):
        yield container, key
        if isinstance(value, dict | list):
            yield from _places(value)


def _table(document: dict[str, Any], path: str) -> dict[str, Any]:
    """Return a table of a document, made if it is missing; a new one where something else stands there."""
    table: dict[str, Any] = document
    for key in path.split("."):
        found = table.get(key)
        if isinstance(found, list) and found and isinstance(found[0], dict):
            found = found[0]
        if not isinstance(found, dict):
            found = table[key] = {}
        table = found
    return table
