"""The scene as values: what a tracer reads. Frozen, comparable, printable, complete.

Lengths are in scene units, angles in degrees. A scene remembers how it was written where that decides what a later
change keeps: whether a screen's corner or its centre was given, and the names of materials.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field, replace
from functools import lru_cache
from typing import Any, Generic, Literal, TypeVar, cast

from lenscl.config.accuracy import Accuracy
from lenscl.config.checks import Vec3
from lenscl.config.lens import Group, Lenses
from lenscl.config.places import Places
from lenscl.effects import Fact, Value, wavelengths_of
from lenscl.materials import Constant, Material

V = TypeVar("V")


class Frozen(Mapping[str, V], Generic[V]):
    """A mapping that never changes: hashable, picklable, equal to any mapping of the same items."""

    __slots__ = ("_items",)

    def __init__(self, items: Mapping[str, V] | None = None) -> None:
        self._items: dict[str, V] = dict(items or {})

    def __getitem__(self, key: str) -> V:
        return self._items[key]

    def __iter__(self) -> Iterator[str]:
        return iter(self._items)

    def __len__(self) -> int:
        return len(self._items)

    def __hash__(self) -> int:
        return hash(frozenset(self._items.items()))

    def __repr__(self) -> str:
        return repr(self._items)


class Effects(Frozen[Value]):
    """What `[effects]` asks for, by key; each key of the registry is also an attribute: `effects.total_reflection`."""

    __slots__ = ()

    def __getattr__(self, key: str) -> Value:
        if key.startswith("_") or key not in self._items:
            raise AttributeError(f"no effect is called {key!r}")
        return self._items[key]


@dataclass(frozen=True, slots=True, kw_only=True)
class Source:
    """Where rays start: `at` for a point, `direction` (of any length) for parallel light."""

    kind: Literal["point", "parallel"]
    at: Vec3 | None = None
    direction: Vec3 | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class _Screen:
    """A parallelogram in space, given by the point that `scale` keeps, its spans before scaling and its size."""

    keeps: Literal["corner", "centre"]
    anchor: Vec3
    unscaled_right: Vec3
    unscaled_down: Vec3
    scale: float
    size: tuple[int, int]  # columns, rows

    @property
    def right(self) -> Vec3:
        """Span along a row, over the whole width, scaled."""
        return _times(self.scale, self.unscaled_right)

    @property
    def down(self) -> Vec3:
        """Span along a column, over the whole height, scaled."""
        return _times(self.scale, self.unscaled_down)

    @property
    def corner(self) -> Vec3:
        """Where both coordinates are 0."""
        return self.anchor if self.keeps == "corner" else self._shifted(-0.5)

    @property
    def centre(self) -> Vec3:
        """Where both coordinates are one half."""
        return self.anchor if self.keeps == "centre" else self._shifted(0.5)

    @property
    def columns(self) -> int:
        """Pixels along `right`."""
        return self.size[0]

    @property
    def rows(self) -> int:
        """Pixels along `down`."""
        return self.size[1]

    def _shifted(self, share: float) -> Vec3:
        x, y, z = (a + share * (r + d) for a, r, d in zip(self.anchor, self.right, self.down, strict=True))
        return x, y, z


@dataclass(frozen=True, slots=True, kw_only=True)
class Film(_Screen):
    """The first screen: each of its pixels sends one ray."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Picture(_Screen):
    """The second screen, which carries an image."""

    images: str | tuple[str, ...] | None
    outside: tuple[float, ...]
    filter: Literal["nearest", "bilinear", "bicubic"]
    encoding: Literal["srgb", "linear"] | None
    stops: Literal["auto"] | bool = "auto"  # whether rays end where they meet it first


@dataclass(frozen=True, slots=True, kw_only=True)
class Numerics:
    """How accurately to compute; lengths in scene units, `tolerance` None for the precision's own default.

    Where `accuracy` is given, the other keys but `max_events` are to be chosen by it and stand at their defaults.
    """

    accuracy: Accuracy | None
    method: str
    precision: Literal["single", "double", "mixed"]
    snell: Literal["exact", "paraxial"]
    step: float
    tolerance: float | None
    max_events: int


@dataclass(frozen=True, slots=True, kw_only=True)
class Needs:
    """What a kernel has to be able to do for some scenes.

    Attributes
    ----------
    facts : frozenset of str
        What effects ask whether it holds, and does of any of them.
    lenses : frozenset of int
        The lenses that rays may reach in any of them, by number.
    """

    facts: frozenset[Fact] = frozenset()
    lenses: frozenset[int] = frozenset()

    def __or__(self, other: Needs) -> Needs:
        """Return what the scenes of both need."""
        return Needs(facts=self.facts | other.facts, lenses=self.lenses | other.lenses)


@dataclass(frozen=True, slots=True, kw_only=True)
class Scene:
    """Everything that decides where a ray goes, and how its colour is looked up."""

    source: Source
    film: Film
    picture: Picture
    medium: Material
    lenses: Lenses
    effects: Effects
    numerics: Numerics
    # What lenses reflect: "picture", the path of an image, or a colour in the picture's own encoding
    environment: str | tuple[float, ...] = "picture"
    # What other points need of the study that the scene belongs to
    needs: Needs = field(default=Needs(), compare=False, repr=False)

    def __post_init__(self) -> None:
        object.__setattr__(self, "lenses", Lenses.of(self.lenses))  # a plain sequence of lenses does as well

    @property
    def n_medium(self) -> float:
        """Refractive index between the lenses, at the d line."""
        return self.medium.n

    @property
    def wavelengths(self) -> tuple[float, ...]:
        """The wavelengths in nm that `effects.dispersion` asks for; none where light is of the d line alone."""
        return wavelengths_of(self.effects["dispersion"])

    def at_wavelength(self, wavelength_nm: float) -> Scene:
        """Return the scene in light of one wavelength: every index a number, and dispersion off.

        Raises
        ------
        StudyError
            If a material has no index there.
        """
        lenses = self.lenses.with_each(lambda lens: replace(lens, material=_at(lens.material, wavelength_nm)))
        return replace(self._undispersed(), medium=_at(self.medium, wavelength_nm), lenses=lenses)

    def layers(self) -> tuple[Scene, ...]:
        """Return the scene at each of its wavelengths; itself, alone, where it has none."""
        return tuple(self.at_wavelength(nm) for nm in self.wavelengths) or (self,)

    def at_d_line(self) -> Scene:
        """Return the scene in light of the d line alone; itself where it has no wavelengths."""
        return self._undispersed() if self.wavelengths else self

    def _undispersed(self) -> Scene:
        return replace(self, effects=Effects({**self.effects, "dispersion": False}))

    def by_priority(self) -> tuple[int, ...]:
        """Return the lenses' numbers, lowest priority first; where solids overlap the last one is the medium."""
        by_priority = sorted(self.lenses.groups, key=lambda group: (group.lens.priority, group.first))
        return tuple(number for group in by_priority for number in group.numbers)

    def blocks(self, number: int) -> bool:
        """Return whether a lens lets no light in: it is opaque, and absorption is not switched off."""
        return self.stops_light(self.lenses.group_of(number))

    def stops_light(self, group: Group) -> bool:
        """Return whether the lenses of a table let no light in, as `blocks` does of one."""
        return group.lens.absorbs and self.effects["absorption"] is not False

    def lens_key(self, number: int) -> str:
        """Return what a study's keys call a lens: "lens.NAME", "lens" where it is the only one, else "lens 2".

        A copy of an array is its place, counted from 0 as the lists of a study are: "lens.NAME.at[2]".
        """
        group = self.lenses.group_of(number)
        return self.table_key(group) + ("" if group.at is None else f".at[{number - group.first}]")

    def table_key(self, group: Group) -> str:
        """Return what a study's keys call a table `[[lens]]`."""
        if group.lens.name is not None:
            return f"lens.{group.lens.name}"
        return "lens" if len(self.lenses.groups) == 1 else f"lens {self.lenses.groups.index(group) + 1}"

    def replace(self, changes: Mapping[str, Any]) -> Scene:
        """Return the scene with some keys changed, checked as a study file is.

        Parameters
        ----------
        changes : mapping
            Value by key, keys as in `[sweep.axes]`: `lens.r`, `lens.NAME.r`, `film.centre.x`, `numerics.precision`.
            A new `lens.surface` drops the parameters that it does not have or that stood at their defaults; a corner
            replaces a centre, and the reverse.

        Raises
        ------
        StudyError
            With every problem, each led by its key.
        """
        from lenscl.config.build import scene_from_document
        from lenscl.config.keys import changed

        return replace(scene_from_document(changed(self.document(plain=False), changes)), needs=self.needs)

    def document(self, *, plain: bool = True) -> dict[str, Any]:
        """Return the scene as the tables of a study file, complete and in a fixed order.

        Parameters
        ----------
        plain : bool
            Whether the places of arrays are lists, as in a file; else they are `Places`, which are read back at once.
        """
        source: dict[str, Any] = {"kind": self.source.kind}
        place = self.source.at if self.source.kind == "point" else self.source.direction
        source["at" if self.source.kind == "point" else "direction"] = list(cast(Vec3, place))
        images = self.picture.images
        picture = _screen_document(self.picture)
        if images is not None:
            picture["images"] = images if isinstance(images, str) else list(images)
        picture["outside"] = list(self.picture.outside)
        picture["filter"] = self.picture.filter
        if self.picture.encoding is not None:
            picture["encoding"] = self.picture.encoding
        if self.picture.stops != "auto":
            picture["stops"] = self.picture.stops
        return {
            "source": source,
            "film": _screen_document(self.film),
            "picture": picture,
            "medium": {"n": _written(self.medium)},
            "lens": [_lens_document(group, plain) for group in self.lenses.groups],
            "effects": {key: _listed(value) for key, value in self.effects.items()} | self._written_environment(),
            "numerics": _numerics_document(self.numerics),
        }

    def _written_environment(self) -> dict[str, Any]:
        """Return `effects.environment` where it is not the default."""
        shown = self.environment
        return {} if shown == "picture" else {"environment": shown if isinstance(shown, str) else list(shown)}

    def to_toml(self) -> str:
        """Return the scene as a study file: the same text for equal scenes, and read back to an equal scene."""
        import tomli_w

        document, arrays = self.document(plain=False), []
        for table in document["lens"]:
            if "at" in table:
                arrays.append(table["at"])
                table["at"] = str(len(arrays) - 1)
        # One line a list: tomli_w breaks each of them, and line ends stand nowhere else inside a value
        text = re.sub(r"\[\n +", "[", tomli_w.dumps(document))
        text = re.sub(r",\n( *)(\])?", lambda end: end[2] or ", ", text)
        return re.sub(r'^at = "(\d+)"$', lambda line: f"at = {_places_text(arrays[int(line[1])])}", text, flags=re.M)


@lru_cache(maxsize=8)  # a sweep of anything else asks for the same places at every point
def _places_text(places: Places) -> str:
    return f"[{', '.join(f'[{x!r}, {y!r}, {z!r}]' for x, y, z in places)}]"


def _times(factor: float, v: Vec3) -> Vec3:
    return factor * v[0], factor * v[1], factor * v[2]


def _at(material: Material, wavelength_nm: float) -> Material:
    if isinstance(material.index, Constant):
        return material
    what = material.name or "an index"
    source = f"{what} at {wavelength_nm:g} nm: {material.source}"
    return Material(name=None, index=Constant(material.index.at(wavelength_nm)), source=source)


def _listed(value: Value) -> Any:
    return list(value) if isinstance(value, tuple) else value


def _listed_names(mirror: bool | tuple[str, ...]) -> Any:
    return mirror if isinstance(mirror, bool) else list(mirror)


def _written(material: Material) -> Any:
    return material.name if material.name is not None else material.index.written()


def _screen_document(screen: Film | Picture) -> dict[str, Any]:
    return {
        screen.keeps: list(screen.anchor),
        "right": list(screen.unscaled_right),
        "down": list(screen.unscaled_down),
        "scale": screen.scale,
        "size": list(screen.size),
    }


def _numerics_document(numerics: Numerics) -> dict[str, Any]:
    if numerics.accuracy is not None:
        return {"accuracy": str(numerics.accuracy), "max_events": numerics.max_events}
    return {
        "method": numerics.method,
        "precision": numerics.precision,
        "snell": numerics.snell,
        "step": numerics.step,
        **({} if numerics.tolerance is None else {"tolerance": numerics.tolerance}),
        "max_events": numerics.max_events,
    }


def _lens_document(group: Group, plain: bool) -> dict[str, Any]:
    lens, at = group.lens, group.at
    return {
        **({} if lens.name is None else {"name": lens.name}),
        "surface": lens.formula,
        **({} if lens.bounds is None else {"bounds": [list(corner) for corner in lens.bounds]}),
        **({} if lens.planes is None else {"planes": [list(plane) for plane in lens.planes]}),
        **{key: lens.values[key] for key in lens.surface.keys if key in lens.values},
        **({"centre": list(lens.centre)} if at is None else {"at": at.tolist() if plain else at}),
        "stretch": list(lens.stretch),
        "rotate": list(lens.rotate),
        **({"n": _written(lens.material)} if lens.has_index else {}),
        **({"absorption": list(lens.absorption)} if any(lens.absorption) else {}),
        **({"absorbs": True} if lens.absorbs else {}),
        **({"mirror": _listed_names(lens.mirror)} if lens.mirror else {}),
        **({"priority": lens.priority} if lens.priority else {}),
    }
