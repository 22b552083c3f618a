"""Where the copies of a lens stand: the rows x, y, z of `[[lens]] at`, written in the study or in a file beside it.

Up to 100,000 rows are kept as one block of bytes: quick to compare, to hash and to pickle.
"""

from __future__ import annotations

import os
import re
import stat
import struct
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import chain
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, overload

from pydantic import PlainValidator, WithJsonSchema
from pydantic_core import PydanticCustomError

from lenscl.config.checks import LONGEST, VEC3_SCHEMA, Number, Numbers, Vec3, wrong
from lenscl.config.problems import as_plain, file_text, short

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

MOST_LENSES = 100_000  # of a scene, every copy counted
_MOST_BYTES = 20_000_000  # of a file of places: 100,000 rows at full precision take a third of it
_ROW = struct.Struct("=3d")
_WHAT = "a list of places [x, y, z], one or more, or the name of a file with a row x, y, z a line"
_PLACE = Numbers(3, 3, "three numbers [x, y, z]")
_NUMBER = Number()
_QUOTED = re.compile(r"""\"[^\"]*\"|'[^']*'""")


@dataclass(frozen=True, slots=True, repr=False)
class Places(Sequence[Vec3]):
    """Places of the world, a frozen sequence of (x, y, z).

    Attributes
    ----------
    rows : bytes
        Three float64 of this machine a place.
    """

    rows: bytes

    @classmethod
    def of(cls, places: Sequence[Sequence[float]] | NDArray[np.float64]) -> Places:
        """Return places given as rows of three numbers; -0.0 becomes 0.0, so that equal scenes are written alike."""
        import numpy as np  # which reading a study without arrays need not wait for

        return cls((np.array(places, dtype=np.float64).reshape(-1, 3) + 0.0).tobytes())

    def __len__(self) -> int:
        return len(self.rows) // _ROW.size

    @overload
    def __getitem__(self, index: int) -> Vec3: ...

    @overload
    def __getitem__(self, index: slice) -> tuple[Vec3, ...]: ...

    def __getitem__(self, index: int | slice) -> Vec3 | tuple[Vec3, ...]:
        if isinstance(index, slice):
            return tuple(self[i] for i in range(*index.indices(len(self))))
        return _ROW.unpack_from(self.rows, _ROW.size * range(len(self))[index])

    def __iter__(self) -> Iterator[Vec3]:
        return _ROW.iter_unpack(self.rows)

    def __repr__(self) -> str:
        return f"<{len(self)} places>"

    @property
    def array(self) -> NDArray[np.float64]:
        """The places as a float64 array, shape (N, 3), that cannot be written to."""
        import numpy as np

        return np.frombuffer(self.rows, dtype=np.float64).reshape(-1, 3)

    def tolist(self) -> list[list[float]]:
        """Return the places as lists, as a study file has them."""
        return [list(place) for place in self]


def check_places(value: Any) -> Places:
    """Return places that are given as a list, or as the name of a file of them."""
    if isinstance(value, Places):
        return value
    if isinstance(value, str) and value:
        return _of_file(value)
    value = as_plain(value)
    if not isinstance(value, list | tuple):
        raise wrong(f"must be {_WHAT}, got {short(value)}")
    if not value:
        raise wrong(f"must be {_WHAT}, got an empty list; leave the lens out, or give it a place")
    _check_count(len(value))
    if _are_numbers(value):
        return Places.of(value)
    rows = []
    for place, row in enumerate(value, 1):
        try:
            rows.append(_PLACE(row))
        except PydanticCustomError as error:
            hint = f"; a single place is written [{short(value)}]" if len(value) == 3 and place == 1 else ""
            hint = hint if isinstance(row, int | float) else ""
            raise wrong(f"must be {_WHAT}; place {place} {error.message()}{hint}") from None
    return Places.of(rows)


def _check_count(count: int) -> None:
    if count > MOST_LENSES:
        raise wrong(f"must have at most {MOST_LENSES} places, got {count}; leave some out")


def _are_numbers(rows: Sequence[Any]) -> bool:
    """Say whether rows are all lists of three plain numbers within limits: the quick way for many."""
    if {type(row) for row in rows} - {list, tuple} or {len(row) for row in rows} != {3}:
        return False
    numbers = list(chain.from_iterable(rows))
    return not {type(number) for number in numbers} - {int, float} and all(
        -LONGEST <= number <= LONGEST for number in numbers
    )


def _of_file(name: str) -> Places:
    """Return the places that a file has: a row x, y, z a line, with commas, tabs or blanks between; `#` comments.

    The first row may be the names of the columns, x, y, z in this order. Any other line that is not three numbers is
    refused, so that no line is lost and no columns change places.
    """
    where = file_text(name)
    rows: list[Vec3] = []
    is_first = True
    for line, text in enumerate(_text(name, where).splitlines(), 1):
        row = text.partition("#")[0].strip()
        if not row:
            continue
        was_first, is_first = is_first, False
        fields = _fields(row)
        if was_first and [field.lower() for field in fields] == ["x", "y", "z"]:
            continue
        try:
            x, y, z = (_NUMBER(_as_number(field)) for field in fields)
        except ValueError as error:  # PydanticCustomError is one
            why = error.message() if isinstance(error, PydanticCustomError) else f"got {short(text.strip())}"
            why += _hint(row, fields, was_first)
            raise wrong(f"{where}, line {line}: must be three finite numbers x, y, z; {why}") from None
        rows.append((x, y, z))
    if not rows:
        raise wrong(f"{where}: has no places; it must have a row x, y, z a line")
    _check_count(len(rows))
    return Places.of(rows)


def _fields(row: str) -> list[str]:
    """Return the fields of a row, without quotation marks.

    One separator holds for a row: the comma if there is one, else the tab, else blanks. So "1,5 2", which may be two
    numbers with decimal commas, is not three, and an empty field between two commas or two tabs remains a field.
    """
    separator = next((mark for mark in ",\t" if mark in row), None)
    fields = re.split(" +", row) if separator is None else [field.strip() for field in row.split(separator)]
    return [field[1:-1].strip() if _QUOTED.fullmatch(field) else field for field in fields]


def _hint(row: str, fields: Sequence[str], is_first: bool) -> str:
    """Return what to say of a row that is refused."""
    if ";" in row:
        return '; the separator ";" is not read: put commas, tabs or blanks between the numbers'
    if "" in fields:
        return "; a field is empty"
    if is_first and any(field[:1].isalpha() for field in fields):
        return "; column names, if the first line has them, must be x, y, z in this order"
    return ""


def _as_number(word: str) -> float:
    if "_" in word:  # which Python takes for a part of a number
        raise ValueError(word)
    return float(word)


def _text(name: str, where: str) -> str:
    try:
        # Never open a pipe or a device: reading it may not end
        if not stat.S_ISREG(os.stat(name).st_mode):
            raise wrong(f"{where}: is not a plain file; name one with a row x, y, z a line")
        with Path(name).open("rb") as file:
            data = file.read(_MOST_BYTES + 1)
    except FileNotFoundError:
        raise wrong(
            f"{where}: there is no such file; give one with a row x, y, z a line, or a list of places"
        ) from None
    except OSError as error:
        raise wrong(f"{where}: cannot be read: {error.strerror or error}") from None
    except PydanticCustomError:
        raise
    except ValueError:  # a null character in its name
        raise wrong(f"must be {_WHAT}, got {short(name)}") from None
    if len(data) > _MOST_BYTES:
        raise wrong(f"{where}: is larger than {_MOST_BYTES} bytes; a file of {MOST_LENSES} places is not")
    try:
        return data.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        raise wrong(f"{where}: is not UTF-8 text (byte {error.start}); a file of places is") from None


At = Annotated[
    Places,
    PlainValidator(check_places),
    WithJsonSchema(
        {
            "anyOf": [
                {"type": "array", "items": VEC3_SCHEMA, "minItems": 1, "maxItems": MOST_LENSES},
                {"type": "string", "minLength": 1, "examples": ["places.csv"]},
            ]
        }
    ),
]
