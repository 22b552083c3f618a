"""A lens as a value, and the lenses of a scene: each table `[[lens]]` once, with all the places of its copies."""

from __future__ import annotations

from bisect import bisect_right
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Any, overload

from lenscl.config.checks import Box, Vec3
from lenscl.config.places import Places
from lenscl.lenses import Surface, face_names, is_whole
from lenscl.materials import Constant, Material

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

_NONE = Material(name=None, index=Constant(1.0), source="")  # stands for a material that is not looked at


@dataclass(frozen=True, slots=True, kw_only=True)
class Lens:
    """A solid F <= 0 of one material, placed in the world.

    `formula` is the surface as written: a name of the catalogue, or an expression, which then has `bounds`.
    """

    name: str | None
    formula: str
    bounds: Box | None
    surface: Surface = field(compare=False, repr=False)  # made from formula and bounds, or planes
    values: Mapping[str, float]  # every parameter of the surface
    centre: Vec3
    stretch: Vec3
    rotate: Vec3  # degrees
    material: Material
    absorption: Vec3 = (0.0, 0.0, 0.0)  # of red, green, blue, per scene unit of the world
    absorbs: bool = False  # opaque: no ray goes on from its surface
    priority: float = 0.0  # where solids overlap the highest is the medium
    planes: tuple[tuple[float, float, float, float], ...] | None = None  # as given: `values` has their numbers
    mirror: bool | tuple[str, ...] = False  # all faces are mirrors, or these, by name
    has_index: bool = True  # else its material is that of the medium, which a mirror may leave open

    @property
    def n(self) -> float:
        """Refractive index at the d line."""
        return self.material.n

    @property
    def coated(self) -> tuple[str, ...]:
        """The names of the faces that are mirrors."""
        return (face_names(self.surface) if self.mirror else ()) if isinstance(self.mirror, bool) else self.mirror

    @property
    def is_mirror(self) -> bool:
        """Whether all of its faces are mirrors."""
        return self.mirror if isinstance(self.mirror, bool) else is_whole(self.surface, self.mirror)

    @property
    def solid(self) -> Lens:
        """What it fills and nothing else, moved to the origin: equal for all lenses of equal solids."""
        return replace(
            self, name=None, centre=(0.0, 0.0, 0.0), material=_NONE, absorption=(0.0, 0.0, 0.0), absorbs=False,
            priority=0.0, mirror=False, has_index=True,
        )  # fmt: skip


@dataclass(frozen=True, slots=True)
class Group:
    """One table `[[lens]]`: a lens, or an array of copies of it.

    Attributes
    ----------
    lens : Lens
        The lens, at the first of its places.
    at : Places or None
        Where its copies stand; None for a lens that is written with its centre.
    first : int
        The number of the first copy among the lenses of the scene; the others follow in the order of the places.
    """

    lens: Lens
    at: Places | None
    first: int

    def __len__(self) -> int:
        return 1 if self.at is None else len(self.at)

    @property
    def numbers(self) -> range:
        """The numbers of its copies among the lenses of the scene."""
        return range(self.first, self.first + len(self))

    @property
    def centres(self) -> NDArray[np.float64]:
        """Where its copies stand, shape (N, 3)."""
        import numpy as np

        return np.array([self.lens.centre], dtype=np.float64) if self.at is None else self.at.array

    def copy(self, place: int) -> Lens:
        """Return one of its copies."""
        return self.lens if self.at is None or place == 0 else replace(self.lens, centre=self.at[place])


class Lenses(Sequence[Lens]):
    """The lenses of a scene, by number: a frozen sequence that keeps the copies of an array as places alone.

    It is equal to any other of the same tables, and hashed once; `groups` has each table once.
    """

    __slots__ = ("_firsts", "_hash", "_length", "_solids", "groups")

    groups: tuple[Group, ...]

    def __init__(self, tables: Iterable[tuple[Lens, Places | None]]) -> None:
        groups, first = [], 0
        for lens, at in tables:
            groups.append(Group(lens if at is None else replace(lens, centre=at[0]), at, first))
            first += len(groups[-1])
        self.groups = tuple(groups)
        self._length = first
        self._firsts = [group.first for group in groups]
        self._hash: int | None = None
        self._solids: Lenses | None = None

    @classmethod
    def of(cls, lenses: Iterable[Lens]) -> Lenses:
        """Return lenses that are no arrays."""
        return lenses if isinstance(lenses, cls) else cls((lens, None) for lens in lenses)

    def __len__(self) -> int:
        return self._length

    @overload
    def __getitem__(self, index: int) -> Lens: ...

    @overload
    def __getitem__(self, index: slice) -> tuple[Lens, ...]: ...

    def __getitem__(self, index: int | slice) -> Lens | tuple[Lens, ...]:
        if isinstance(index, slice):
            return tuple(self[number] for number in range(*index.indices(self._length)))
        number = range(self._length)[index]
        group = self.group_of(number)
        return group.copy(number - group.first)

    def __iter__(self) -> Iterator[Lens]:
        for group in self.groups:
            yield from (group.copy(place) for place in range(len(group)))

    def __eq__(self, other: object) -> bool:
        if self is other:
            return True
        if isinstance(other, Lenses):
            return self.groups == other.groups
        return isinstance(other, tuple) and len(other) == len(self) and all(a == b for a, b in zip(self, other))  # noqa: B905

    def __hash__(self) -> int:
        if self._hash is None:
            self._hash = hash(self.groups)
        return self._hash

    def __repr__(self) -> str:
        return f"Lenses({[group.lens if group.at is None else (group.lens, group.at) for group in self.groups]!r})"

    def __reduce__(self) -> tuple[Any, ...]:
        return Lenses, ([(group.lens, group.at) for group in self.groups],)

    def group_of(self, number: int) -> Group:
        """Return the table that a lens is of.

        Raises
        ------
        IndexError
            If there is no lens of that number.
        """
        if not 0 <= number < self._length:
            raise IndexError(f"there is no lens of number {number} among {self._length}")
        return self.groups[bisect_right(self._firsts, number) - 1]

    @property
    def solids(self) -> Lenses:
        """The solids alone, each in its place: equal for lenses that differ in materials, names and priorities."""
        if self._solids is None:
            self._solids = self.with_each(lambda lens: replace(lens.solid, centre=lens.centre))
            self._solids._solids = self._solids
        return self._solids

    def with_each(self, change: Callable[[Lens], Lens]) -> Lenses:
        """Return the lenses with each table's lens changed in what its copies share."""
        return Lenses((change(group.lens), group.at) for group in self.groups)
