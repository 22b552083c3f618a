"""What one value of a study may be. Each check returns the value in its one canonical form or says what is wrong."""

from __future__ import annotations

import math
import re
from collections.abc import Callable
from dataclasses import dataclass
from itertools import pairwise
from numbers import Integral, Real
from typing import Annotated, Any

from pydantic import PlainValidator, WithJsonSchema
from pydantic_core import PydanticCustomError

from lenscl.config.accuracy import Accuracy
from lenscl.config.problems import PARTS, as_plain, nearest, short, unknown_key
from lenscl.effects import LISTED, WAVELENGTH_LIMITS
from lenscl.errors import StudyError
from lenscl.lenses import FEWEST_PLANES, MOST_PLANES
from lenscl.materials import (
    ALIASES,
    CATALOGUE,
    HIGHEST_N,
    Abbe,
    Cauchy,
    Constant,
    Index,
    Material,
    Sellmeier,
    Table,
    index_problems,
    material,
)

LONGEST = 1e12  # scene units: products of three such lengths are still finite in single precision
SHORTEST = 1e-12  # likewise not yet zero
MOST_PIXELS = 2**31
_MOST_DISPERSION = 10_000  # numbers of one dispersion formula
_ACCURACY = 'a positive length, such as "0.05 px" in pixels of the picture or "1e-9" in scene units'
_NUMBER_AS_TEXT = re.compile(r"[+-]?(\d{1,30}([.,]\d{0,30})?|[.,]\d{1,30})([eE][+-]?\d{1,3})?")
_OWN_INDEX = "stated in the study"

Vec3 = tuple[float, float, float]
Box = tuple[Vec3, Vec3]


def wrong(what: str) -> PydanticCustomError:
    """Return the error of one value; its key is added by the table it stands in."""
    return PydanticCustomError("study", "{what}", {"what": what})


def wrong_parts(problems: list[str]) -> PydanticCustomError:
    """Return the errors of a table that stands as a value; each is led by its key in that table."""
    return PydanticCustomError(PARTS, "{problems}", {"problems": problems})


def _as_number(value: Any) -> str:
    """Return how a number that is written as a text is written; empty where a value is no such text."""
    if not isinstance(value, str) or not _NUMBER_AS_TEXT.fullmatch(value.strip()):
        return ""
    number = float(value.strip().replace(",", "."))
    return f"; a number is written without quotation marks and with a point, {number:.15g}"


@dataclass(frozen=True, slots=True)
class Number:
    """A finite float within limits."""

    low: float = -LONGEST
    high: float = LONGEST
    above: float | None = None  # an open lower limit
    what: str = "a finite number"

    def __call__(self, value: Any) -> float:
        """Return the number; -0.0 becomes 0.0, so that equal scenes are written alike."""
        value = as_plain(value)
        if isinstance(value, bool) or not isinstance(value, Real):
            raise wrong(f"must be {self.what}, got {short(value)}{_as_number(value)}")
        try:
            number = float(value) + 0.0
        except OverflowError:
            number = math.inf
        if not math.isfinite(number):
            raise wrong(f"must be {self.what}, got {short(value)}")
        if self.above is not None and not number > self.above:
            raise wrong(f"must be greater than {self.above:g}, got {short(value)}")
        if not self.low <= number <= self.high:
            raise wrong(f"must lie from {self.low:g} to {self.high:g}, got {short(value)}")
        return number


@dataclass(frozen=True, slots=True)
class Whole:
    """A whole number within limits, both in; 64.0 is one."""

    low: int
    high: int

    def __call__(self, value: Any) -> int:
        """Return the whole number."""
        value = as_plain(value)
        is_whole = isinstance(value, Integral) or (isinstance(value, float) and value.is_integer())
        if isinstance(value, bool) or not is_whole:
            raise wrong(f"must be a whole number from {self.low} to {self.high}, got {short(value)}{_as_number(value)}")
        if not self.low <= value <= self.high:
            raise wrong(f"must lie from {self.low} to {self.high}, got {short(value)}")
        return int(value)


@dataclass(frozen=True, slots=True)
class OneOf:
    """A word, or another plain value, of a list."""

    known: tuple[str | bool, ...]

    def __call__(self, value: Any) -> str | bool:
        """Return the word."""
        if isinstance(value, str | bool) and any(value is known or value == known for known in self.known):
            return value
        choices = " or ".join(short(known) for known in self.known)
        hint = (
            nearest(value, [known for known in self.known if isinstance(known, str)]) if isinstance(value, str) else ""
        )
        raise wrong(f"must be {choices}, got {short(value)}{hint if 'did you mean' in hint else ''}")


@dataclass(frozen=True, slots=True)
class Numbers:
    """A fixed or bounded count of numbers, as a tuple."""

    fewest: int
    most: int
    what: str
    each: Callable[[Any], Any] = Number()
    positive_length: bool = False

    def __call__(self, value: Any) -> tuple[Any, ...]:
        """Return the numbers; a fault names the place in the list."""
        value = as_plain(value)
        if not isinstance(value, list | tuple) or not self.fewest <= len(value) <= self.most:
            raise wrong(f"must be {self.what}, got {short(value)}")
        numbers = []
        for place, entry in enumerate(value):
            try:
                numbers.append(self.each(entry))
            except PydanticCustomError as error:
                raise wrong(f"must be {self.what}; the value at place {place + 1} {error.message()}") from None
        if self.positive_length and not math.hypot(*numbers) >= SHORTEST:
            raise wrong(f"must not be shorter than {SHORTEST:g}, got {short(list(value))}")
        return tuple(numbers)


def check_stretch(value: Any) -> Vec3:
    """Return the three factors of a placement; a negative one mirrors, zero would flatten the solid."""
    x, y, z = _VECTOR(value)
    if any(abs(factor) < SHORTEST for factor in (x, y, z)):
        raise wrong(f"must have no factor of 0 (a squash goes down to {SHORTEST:g}), got {short([x, y, z])}")
    return x, y, z


def check_box(value: Any) -> Box:
    """Return the bounds of a user's surface, each low side below its high side."""
    what = "two corners [[x, y, z], [x, y, z]], the lower first"
    value = as_plain(value)
    if not isinstance(value, list | tuple) or len(value) != 2:
        raise wrong(f"must be {what}, got {short(value)}")
    low, high = (Numbers(3, 3, what)(corner) for corner in value)
    for axis, a, b in zip("xyz", low, high, strict=True):
        if not b - a >= SHORTEST:
            raise wrong(f"must be {what}; along {axis} {a!r} is not below {b!r}")
    return (low[0], low[1], low[2]), (high[0], high[1], high[2])


def check_planes(value: Any) -> tuple[tuple[float, float, float, float], ...]:
    """Return the planes of a polyhedron; a plane's normal has a length."""
    what = f"{FEWEST_PLANES} to {MOST_PLANES} planes [a, b, c, d], the solid being where a x + b y + c z <= d"
    value = as_plain(value)
    if not isinstance(value, list | tuple) or not FEWEST_PLANES <= len(value) <= MOST_PLANES:
        found = f"{len(value)} of them" if isinstance(value, list | tuple) else short(value)
        raise wrong(f"must be {what}, got {found}")
    planes = []
    for place, entry in enumerate(value, 1):
        try:
            a, b, c, d = Numbers(4, 4, "four numbers [a, b, c, d]")(entry)
        except PydanticCustomError as error:
            raise wrong(f"must be {what}; plane {place} {error.message()}") from None
        if not SHORTEST <= max(abs(a), abs(b), abs(c)) <= 1.0 / SHORTEST:
            raise wrong(f"must be {what}; plane {place} must have a normal [a, b, c] that is not 0, got {short(entry)}")
        planes.append((a, b, c, d))
    return tuple(planes)


def check_mirror(value: Any) -> bool | tuple[str, ...]:
    """Return whether all faces are mirrors, or the names of those that are; whether there are such is judged later."""
    value = as_plain(value)
    if isinstance(value, bool):
        return value
    what = 'true, false, or a list of names of faces such as ["back"]'
    if isinstance(value, str):
        word = value.strip().casefold()
        hint = f"; write {word}, without quotation marks" if word in ("true", "false") else f"; write [{short(value)}]"
        raise wrong(f"must be {what}, got {short(value)}{hint}")
    if not isinstance(value, list | tuple):
        raise wrong(f"must be {what}, got {short(value)}")
    if not value:
        raise wrong(f"must be {what}, got an empty list; where no face is a mirror write false, or leave it out")
    names: list[str] = []
    for place, name in enumerate(value, 1):
        if isinstance(name, int) and not isinstance(name, bool):
            raise wrong(f'must be {what}; the value at place {place} is a number; write ["{name}"]')
        if not isinstance(name, str):
            raise wrong(f"must be {what}; the value at place {place} must be a text, got {short(name)}")
        if name in names:
            raise wrong(f"must be {what}; {short(name)} is named twice; keep one of the two")
        names.append(name)
    return tuple(names)


def check_size(value: Any) -> tuple[int, int]:
    """Return (columns, rows) of a film or a picture."""
    columns, rows = Numbers(2, 2, "two whole numbers [columns, rows]", Whole(1, MOST_PIXELS))(value)
    if columns * rows > MOST_PIXELS:
        raise wrong(f"must have at most 2^31 pixels, got {columns} x {rows}")
    return columns, rows


def check_images(value: Any) -> str | tuple[str, ...]:
    """Return a glob pattern, or several."""
    patterns = [value] if isinstance(value, str) else value
    if (
        not isinstance(patterns, list | tuple)
        or not patterns
        or not all(isinstance(one, str) and one for one in patterns)
    ):
        raise wrong(f'must be a pattern such as "pictures/*", or a list of patterns, got {short(value)}')
    for one in patterns:
        if "\0" in one or len(one) > 4096:
            raise wrong(f"must be a pattern of file names, got {short(one)}")
        if "**" in one or sum("*" in part or "?" in part or "[" in part for part in one.split("/")) > 3:
            raise wrong(f"must not search whole trees (** or more than three wildcard parts), got {short(one)}")
    return value if isinstance(value, str) else tuple(patterns)


def check_text(value: Any) -> str:
    """Return a text."""
    if not isinstance(value, str):
        raise wrong(f"must be a text, got {short(value)}")
    return value


def check_accuracy(value: Any) -> Accuracy:
    """Return a wanted accuracy; a bare number is one in scene units, as a text without `px` is."""
    value = as_plain(value)
    text = value if isinstance(value, str) else repr(Number(above=0.0, what=_ACCURACY)(value))
    if (accuracy := Accuracy.read(text)) is None:
        raise wrong(f"must be {_ACCURACY}, got {short(value)}")
    return accuracy


def check_wavelengths(value: Any) -> tuple[float, ...]:
    """Return wavelengths in nm, each longer than the one before."""
    low, high = WAVELENGTH_LIMITS
    found = Numbers(*LISTED, _WAVELENGTHS, Number(low, high))(value)
    for place, (before, after) in enumerate(pairwise(found), start=2):
        if not after > before:
            raise wrong(f"must be {_WAVELENGTHS}; the value at place {place} does not rise, {after:g} after {before:g}")
    return found


def check_index(value: Any) -> Material:
    """Return the material that a number, a catalogue name or a dispersion formula stands for."""
    value = as_plain(value)
    if isinstance(value, str):
        if hint := _as_number(value):
            raise wrong(f"must be a number, a material's name or a formula, got {short(value)}{hint}")
        try:
            return material(value)
        except StudyError as error:
            raise wrong(f"must be a number, a material's name or a formula; {error}") from None
    index = _formula(value) if isinstance(value, dict) else Constant(Number(what="an index, a number")(value))
    for problem in index_problems(index):
        raise wrong(problem)
    return Material(name=None, index=index, source=_OWN_INDEX)


def _formula(value: dict[str, Any]) -> Index:
    """Return the dispersion formula of a table with exactly one of its three keys, or with nd and vd."""
    if any(str(key).casefold() in _ABBE for key in value) and not any(key in _FORMULAS for key in value):
        return _abbe(value)
    if len(value) != 1 or next(iter(value)) not in _FORMULAS:
        formulas = "{ nd = ..., vd = ... }, { sellmeier = [...] }, { cauchy = [...] } or { table = [[nm, n], ...] }"
        keys = ", ".join(short(key) for key in list(value)[:4]) or "no keys"
        raise wrong(f"must be a number, a material's name, {formulas}, got a table with {keys}")
    kind, numbers = next(iter(value.items()))
    return _FORMULAS[kind](as_plain(numbers))


def _abbe(table: dict[str, Any]) -> Index:
    """Return the index of { nd = ..., vd = ... }; every fault of the two keys is told of, not the first alone."""
    problems = [unknown_key("", key, _ABBE) for key in table if key not in _ABBE]
    found: dict[str, float] = {}
    for key, check in _ABBE.items():
        if key not in table:
            problems.append(f"{key}: is required; an index at the d line and an Abbe number are written {_BOTH}")
            continue
        try:
            found[key] = check(table[key])
        except PydanticCustomError as error:
            problems.append(f"{key}: {error.message()}")
    if problems:
        raise wrong_parts(problems)
    return Abbe(**found)


def _sellmeier(numbers: Any) -> Index:
    what = "sellmeier = [B1, B2, ..., C1, C2, ...], as many C (in square micrometres) as B"
    values = Numbers(2, _MOST_DISPERSION, what)(numbers)
    if len(values) % 2:
        raise wrong(f"must be {what}, got {len(values)} numbers")
    half = len(values) // 2
    return Sellmeier(values[:half], values[half:])


def _cauchy(numbers: Any) -> Index:
    what = "cauchy = [A, B, C, ...], for A + B/L^2 + C/L^4 with L in micrometres"
    return Cauchy(Numbers(1, _MOST_DISPERSION, what)(numbers))


def _table(rows: Any) -> Index:
    what = "table = [[nm, n], ...], two or more, rising in nm"
    pairs = Numbers(2, _MOST_DISPERSION, what, Numbers(2, 2, "[nm, n]"))(rows)
    if any(not b[0] > a[0] for a, b in pairwise(pairs)):
        raise wrong(f"must be {what}, got a wavelength that does not rise")
    return Table(tuple(nm for nm, _ in pairs), tuple(n for _, n in pairs))


_FORMULAS: dict[str, Callable[[Any], Index]] = {"sellmeier": _sellmeier, "cauchy": _cauchy, "table": _table}
_FORMULA_ABOUT = {
    "sellmeier": "Sellmeier coefficients [B1, B2, ..., C1, C2, ...], each C in square micrometres.",
    "cauchy": "Cauchy coefficients [A, B, C, ...] of A + B/L^2 + C/L^4 + ..., L in micrometres.",
    "table": "Pairs [nm, n], two or more, rising in nm.",
}
_ABBE = {
    "nd": Number(low=1.0, high=HIGHEST_N, what="a refractive index at the d line, a number from 1"),
    "vd": Number(above=0.0, what="an Abbe number, positive"),
}
_BOTH = "{ nd = 1.5168, vd = 64.17 }"
_WAVELENGTHS = f"a rising list of {LISTED[0]} to {LISTED[1]} wavelengths in nm"
_VECTOR = Numbers(3, 3, "three numbers [x, y, z]")

_NUMBERS_SCHEMA: dict[str, Any] = {"type": "array", "items": {"type": "number"}}
VEC3_SCHEMA = {**_NUMBERS_SCHEMA, "minItems": 3, "maxItems": 3}
INDEX_SCHEMA: dict[str, Any] = {
    "anyOf": [
        {"type": "number", "exclusiveMinimum": 0},
        {"type": "string", "examples": [*CATALOGUE, *ALIASES]},
        *(
            {
                "type": "object",
                "properties": {kind: {"type": "array", "description": about}},
                "required": [kind],
                "additionalProperties": False,
            }
            for kind, about in _FORMULA_ABOUT.items()
        ),
        {
            "type": "object",
            "properties": {
                "nd": {
                    "type": "number",
                    "minimum": 1,
                    "maximum": HIGHEST_N,
                    "description": "Refractive index at the d line, 587.5618 nm.",
                },
                "vd": {"type": "number", "exclusiveMinimum": 0, "description": "Abbe number, (nd - 1) / (nF - nC)."},
            },
            "required": list(_ABBE),
            "additionalProperties": False,
        },
    ]
}

Factor = Annotated[float, PlainValidator(Number(above=0.0)), WithJsonSchema({"type": "number", "exclusiveMinimum": 0})]
Vector = Annotated[Vec3, PlainValidator(_VECTOR), WithJsonSchema(VEC3_SCHEMA)]
Direction = Annotated[
    Vec3,
    PlainValidator(Numbers(3, 3, "three numbers [x, y, z]", positive_length=True)),
    WithJsonSchema(VEC3_SCHEMA),
]
Stretch = Annotated[Vec3, PlainValidator(check_stretch), WithJsonSchema(VEC3_SCHEMA)]
Bounds = Annotated[
    Box,
    PlainValidator(check_box),
    WithJsonSchema({"type": "array", "items": VEC3_SCHEMA, "minItems": 2, "maxItems": 2}),
]
Planes = Annotated[
    tuple[tuple[float, float, float, float], ...],
    PlainValidator(check_planes),
    WithJsonSchema(
        {
            "type": "array",
            "items": {"type": "array", "items": {"type": "number"}, "minItems": 4, "maxItems": 4},
            "minItems": FEWEST_PLANES,
            "maxItems": MOST_PLANES,
        }
    ),
]
Mirror = Annotated[
    bool | tuple[str, ...],
    PlainValidator(check_mirror),
    WithJsonSchema(
        {
            "anyOf": [
                {"type": "boolean"},
                {"type": "array", "items": {"type": "string"}, "minItems": 1, "uniqueItems": True},
            ]
        }
    ),
]
Size = Annotated[
    tuple[int, int],
    PlainValidator(check_size),
    WithJsonSchema({"type": "array", "items": {"type": "integer", "minimum": 1}, "minItems": 2, "maxItems": 2}),
]
Colour = Annotated[
    tuple[float, ...],
    PlainValidator(Numbers(1, 4, "one to four numbers, the channels of a colour")),
    WithJsonSchema({**_NUMBERS_SCHEMA, "minItems": 1, "maxItems": 4}),
]
Absorption = Annotated[
    Vec3,
    PlainValidator(Numbers(3, 3, "three numbers [red, green, blue]", each=Number(low=0.0))),
    WithJsonSchema({"type": "array", "items": {"type": "number", "minimum": 0}, "minItems": 3, "maxItems": 3}),
]
Images = Annotated[
    str | tuple[str, ...],
    PlainValidator(check_images),
    WithJsonSchema({"anyOf": [{"type": "string"}, {"type": "array", "items": {"type": "string"}, "minItems": 1}]}),
]
Text = Annotated[str, PlainValidator(check_text), WithJsonSchema({"type": "string"})]
Wanted = Annotated[
    Accuracy,
    PlainValidator(check_accuracy),
    WithJsonSchema({"anyOf": [{"type": "string", "examples": ["0.05 px", "1e-9"]}, {"type": "number"}]}),
]
Medium = Annotated[Material, PlainValidator(check_index), WithJsonSchema(INDEX_SCHEMA)]
