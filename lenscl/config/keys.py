"""Keys that point into a scene: `lens.r`, `lens.front.stretch.x`, `film.size.columns`, `numerics.precision`."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import dataclass
from typing import Any

from lenscl.config.places import Places
from lenscl.config.problems import as_plain, key_text, nearest, study_error
from lenscl.config.read_lenses import COORDINATES, LENS_KEYS, NAME, is_catalogue_name
from lenscl.config.tables import BY_HAND, ENVIRONMENT, SCENE_TABLES
from lenscl.effects import EFFECTS
from lenscl.lenses import catalogue

_AXES: dict[str, int | str] = {"x": 0, "y": 1, "z": 2}
_SIDES: dict[str, int | str] = {"columns": 0, "rows": 1}
_COMPONENTS: dict[str, dict[str, int | str]] = {
    **dict.fromkeys(("at", "direction", "corner", "centre", "right", "down", "stretch", "rotate"), _AXES),
    "size": _SIDES,
    "n": {"nd": "nd", "vd": "vd"},  # of an index that is written as a table of the two
}
_LENS_KEYS = ("centre", "at", "stretch", "rotate", "n", "absorption", "absorbs", "mirror", "priority")
_NEVER_SWEPT = ("lens.name", "picture.images")
_DECIDING = (".surface", ".kind", ".corner", ".centre", ".at")
# Writing a key takes those away that cannot stand beside it
_RIVALS = {
    f"{screen}.{key}": (f"{screen}.{other}",)
    for screen in ("film", "picture")
    for key, other in (("corner", "centre"), ("centre", "corner"))
} | {
    "numerics.accuracy": tuple(f"numerics.{key}" for key in BY_HAND),
    **{f"numerics.{key}": ("numerics.accuracy",) for key in BY_HAND},
}

_PLACED = {"at": "centre", "centre": "at"}  # of lenses: an array stands at its places, one lens at its centre


@dataclass(frozen=True, slots=True)
class Place:
    """Where a key points: a table of the document, a key of it, and a component of a list or a table there, or None."""

    table: dict[str, Any]
    key: str
    component: int | str | None

    @property
    def identity(self) -> tuple[int, str, int | str | None]:
        """Equal for two spellings of one place."""
        return id(self.table), self.key, self.component

    def value(self) -> Any:
        """Return what stands there; None where the key is not written."""
        found = self.table.get(self.key)
        if isinstance(found, Places):
            return found.tolist()
        return found if self.component is None or found is None else found[self.component]


def places(document: dict[str, Any]) -> dict[str, Place]:
    """Return every key that points into a scene's document, in the order of the file."""
    found: dict[str, Place] = {}
    for name in ("source", "film", "picture", "medium"):
        _add(found, name, document[name], list(SCENE_TABLES[name].model_fields))
    lenses = document["lens"]
    for lens in lenses:
        # One lens is reached with and without its name, several by their names only
        prefixes = [f"lens.{lens['name']}"] if "name" in lens else []
        for prefix in [*prefixes, "lens"] if len(lenses) == 1 else prefixes:
            parameters = dict.fromkeys(
                [*(key for key in lens if key not in LENS_KEYS), *parameter_names(lens.get("surface"))]
            )
            own = [key for key in _LENS_KEYS if key != "centre" or not _is_array(lens)]
            _add(found, prefix, lens, ["name", "surface", "bounds", "planes", *parameters, *own])
    _add(found, "effects", document["effects"], [*EFFECTS, ENVIRONMENT])
    _add(found, "numerics", document["numerics"], list(SCENE_TABLES["numerics"].model_fields))
    return found


def _is_array(lens: Mapping[str, Any]) -> bool:
    return lens.get("at") is not None and "centre" not in lens


def parameter_names(formula: Any) -> list[str]:
    """Return the parameters that a surface may have: its own of the catalogue, the words of an expression."""
    if not isinstance(formula, str):
        return []
    if formula in catalogue():
        return [*catalogue()[formula].keys]
    return [] if is_catalogue_name(formula) else [word for word in NAME.findall(formula) if word not in COORDINATES]


def _add(found: dict[str, Place], prefix: str, table: dict[str, Any], keys: list[str]) -> None:
    for key in keys:
        found[f"{prefix}.{key}"] = Place(table, key, None)
        for component, index in _COMPONENTS.get(key, {}).items():
            if _has(table.get(key), index):
                found[f"{prefix}.{key}.{component}"] = Place(table, key, index)


def _has(entry: Any, component: int | str) -> bool:
    """Return whether a value has a component; a surface's parameter may be called like a vector."""
    if isinstance(component, str):
        return isinstance(entry, dict) and component in entry
    return isinstance(entry, list) and component < len(entry) and not isinstance(entry[component], list)


def whole_of(key: str) -> str | None:
    """Return the key of the vector or size that a component belongs to: `lens.stretch` of `lens.stretch.x`."""
    whole, _, last = key.rpartition(".")
    return whole if last in _COMPONENTS.get(whole.rpartition(".")[2], {}) else None


def rivals_of(key: str) -> tuple[str, ...]:
    """Return the keys that cannot stand beside this one: `film.centre` for `film.corner.x`."""
    whole = whole_of(key) or key
    stem, _, last = whole.rpartition(".")
    if last in _PLACED and stem.partition(".")[0] == "lens":
        return (f"{stem}.{_PLACED[last]}",)
    return _RIVALS.get(whole, ())


def overruled(keys: Collection[str], by: Collection[str]) -> set[str]:
    """Return the keys whose defaults cannot stand in a point that sets others.

    Those are wholes of components that it sets, the reverse, and rivals; of defaults among themselves, components.
    """
    wholes = {whole_of(key) or key for key in by}
    gone = {
        key
        for key in keys
        if key not in by and (key in wholes or whole_of(key) in by or not wholes.isdisjoint(rivals_of(key)))
    }
    return gone | {key for key in keys if key not in by and whole_of(key) in keys and whole_of(key) not in gone}


def never_swept(key: str) -> bool:
    """Return whether a key means nothing for a single point."""
    return key in _NEVER_SWEPT or (key.startswith("lens.") and key.endswith(".name"))


def key_problem(key: str, known: Mapping[str, Place], document: Mapping[str, Any]) -> str | None:
    """Return why a key points nowhere, or None."""
    if key in known:
        return None
    names = [lens.get("name") for lens in document["lens"]]
    parts = key.split(".")
    if parts[0] == "lens" and len(names) > 1 and len(parts) > 1 and parts[1] not in names:
        listed = ", ".join(str(name) for name in names[:8])
        return f"{key_text(key)}: with several lenses write lens.NAME.{key_text(parts[-1])}; the names are {listed}"
    whole = whole_of(key)
    stem, _, last = (whole or key).rpartition(".")
    if stem.partition(".")[0] == "lens" and f"{stem}.at" in known:
        if last == "centre":
            return (
                f"{key_text(key)}: {stem} is an array, which has no centre; set {stem}.at, all its places as a list or "
                "the name of a file of them, or write centre in the place of at in the file"
            )
        if last == "at":
            return f"{key_text(key)}: {stem}.at is set as a whole, a list of places or the name of a file of them"
    if whole in known and key.rpartition(".")[2] in _COMPONENTS["n"]:
        return f"{key_text(key)}: {whole} has no such part; write {whole} = {{ nd = ..., vd = ... }} in the file"
    hint = nearest(key, known)
    return f"{key_text(key)}: unknown key{hint if 'did you mean' in hint else '; it must name a value of the scene'}"


def changed(document: dict[str, Any], changes: Mapping[str, Any]) -> dict[str, Any]:
    """Change some keys of a document, and return it; the values are judged later, when it is read.

    Raises
    ------
    StudyError
        For keys that point nowhere, or to what another of the keys sets.
    """
    problems = []
    known = places(document)
    wholes = {whole_of(key) or key for key in changes}
    written: dict[tuple[int, str, int | str | None], str] = {}
    # What decides which other keys there are goes first, components go last
    for key in sorted(changes, key=lambda key: (not key.endswith(_DECIDING), whole_of(key) is not None)):
        problem = _clash(key, known, changes, written) or key_problem(key, known, document)
        if problem is not None:
            problems.append(problem)
            continue
        place, value = known[key], as_plain(changes[key])
        written[place.identity] = key
        if place.component is None:
            for rival in rivals_of(key):
                if rival not in wholes:  # with both set, the reader says that one is too many
                    place.table.pop(rival.rpartition(".")[2], None)
            _write(place.table, place.key, value)
            known = places(document) if key.endswith(_DECIDING) else known
        else:
            place.table[place.key][place.component] = value
    if problems:
        raise study_error(problems)
    return document


def _clash(
    key: str,
    known: Mapping[str, Place],
    changes: Mapping[str, Any],
    written: Mapping[tuple[int, str, int | str | None], str],
) -> str | None:
    """Return why a key cannot be set beside those written before it, under whatever spelling, or None."""
    whole, place = whole_of(key), known.get(key)
    if whole not in changes:
        whole = None if place is None else written.get((id(place.table), place.key, None))
    if place is not None and place.identity in written:
        return f"{key_text(key)}: is set already, as {written[place.identity]}; keep one of the two"
    if whole is not None:
        return f"{key_text(key)}: is set already, as a part of {whole}; keep one of the two"
    return None


def _write(table: dict[str, Any], key: str, value: Any) -> None:
    """Write a whole value, and take away what cannot stand beside it."""
    if key == "kind" and value in ("point", "parallel"):
        table.pop("direction" if value == "point" else "at", None)
    if key == "surface" and isinstance(value, str) and value != table.get("surface"):
        _drop_old_surface(table, value)
    table[key] = list(value) if isinstance(value, tuple) else value


def _drop_old_surface(lens: dict[str, Any], new: str) -> None:
    """Take away the parameters that the new surface lacks, or that were the old one's defaults, and idle bounds."""
    has = set(parameter_names(new))
    defaults: dict[str, float] = {}
    if is_catalogue_name(new):  # an expression has no defaults: what it names, it needs
        lens.pop("bounds", None)
        old = catalogue().get(str(lens.get("surface")))
        defaults = {} if old is None else {parameter.name: parameter.default for parameter in old.parameters}
    if new != "polyhedron":
        lens.pop("planes", None)
    for key in [key for key in lens if key not in LENS_KEYS]:
        if key not in has or lens[key] == defaults.get(key):
            del lens[key]
