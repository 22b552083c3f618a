"""Frozen dataclasses that hold arrays, as values: compared by content, hashable, copied shallow or deep."""

from __future__ import annotations

from collections.abc import Mapping
from copy import deepcopy
from dataclasses import fields
from typing import Any, Self

import numpy as np


class ArrayValue:
    """Base of frozen dataclasses, made with `eq=False`, whose fields may be arrays, mappings of arrays, or values.

    Two are equal if they are of one type and all fields are equal that the dataclass compares: arrays in shape, dtype
    and content, where NaN equals NaN. A deep copy has arrays of its own, and shares everything that cannot change.
    """

    def __eq__(self, other: object) -> bool:
        if self is other:
            return True
        if not isinstance(other, ArrayValue) or type(other) is not type(self):  # an array would compare item by item
            return False
        return all(_same(mine, its) for mine, its in zip(self._parts(), other._parts(), strict=True))

    def __hash__(self) -> int:
        shapes = (part.shape for part in self._parts() if isinstance(part, np.ndarray))
        return hash((type(self), *shapes))

    def _parts(self) -> list[Any]:
        """Return what equality compares."""
        return [getattr(self, each.name) for each in fields(self) if each.compare]  # type: ignore[arg-type]

    def __copy__(self) -> Self:
        return self._with({**self.__dict__})

    def __deepcopy__(self, memo: dict[int, Any]) -> Self:
        return self._with({name: _copied(value, memo) for name, value in self.__dict__.items()})

    def _with(self, attributes: dict[str, Any]) -> Self:
        made = object.__new__(type(self))
        made.__dict__.update(attributes)
        return made


def _same(one: Any, other: Any) -> bool:
    if isinstance(one, np.ndarray) and isinstance(other, np.ndarray):
        has_nan = one.dtype.kind == "f"
        return one.dtype == other.dtype and np.array_equal(one, other, equal_nan=has_nan)
    if isinstance(one, Mapping) and isinstance(other, Mapping):
        return one.keys() == other.keys() and all(_same(value, other[key]) for key, value in one.items())
    return bool(one == other)


def _copied(value: Any, memo: dict[int, Any]) -> Any:
    if isinstance(value, np.ndarray | ArrayValue):
        return deepcopy(value, memo)
    if isinstance(value, tuple):
        return tuple(_copied(part, memo) for part in value)
    if isinstance(value, Mapping) and any(isinstance(part, np.ndarray) for part in value.values()):
        return type(value)({key: _copied(part, memo) for key, part in value.items()})  # type: ignore[call-arg]
    return value
