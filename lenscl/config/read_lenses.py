"""From the tables [[lens]] of a study file to lenses, with every problem found on the way."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Mapping
from dataclasses import replace
from functools import lru_cache
from typing import Any

from pydantic_core import PydanticCustomError

from lenscl.config.checks import Box, check_mirror
from lenscl.config.lens import Lens
from lenscl.config.places import MOST_LENSES, Places
from lenscl.config.problems import MOST_PROBLEMS, Report, key_text, nearest, short, unknown_key, validated
from lenscl.config.scene import Frozen
from lenscl.config.tables import LensTable
from lenscl.errors import LensclError
from lenscl.lenses import (
    OCTAHEDRON,
    Surface,
    catalogue,
    coated_planes,
    face_names,
    meant_as,
    plane_values,
    polyhedron,
    surface,
    user_surface,
)
from lenscl.materials import Material

NAME = re.compile(r"[A-Za-z_][A-Za-z0-9_]*")
COORDINATES = ("x", "y", "z")
LENS_KEYS = tuple(LensTable.model_fields)
_ANYWHERE: Box = ((-1.0,) * 3, (1.0,) * 3)  # stands for bounds that are missing, while an expression is read
_MOST_NAMED = 24  # faces that a message lists


def read_lenses(
    document: Mapping[str, Any], medium: Material | None, problems: list[str]
) -> list[tuple[Lens, Places | None]]:
    """Return the lenses; `medium` is what is between them, None where that is not known."""
    report = problems.append
    tables = document.get("lens")
    if tables is None:
        report("lens: is required; add a table [[lens]] with a surface and an index n")
        return []
    if isinstance(tables, dict):
        named = [key for key, value in tables.items() if isinstance(value, dict)][:1]
        how = f'; [lens.{key_text(named[0])}] is [[lens]] with a key name = "{key_text(named[0])}"' if named else ""
        report(f"lens: a study has one lens or more, so its table is written [[lens]], with double brackets{how}")
        return []
    if not isinstance(tables, list) or not tables or not all(isinstance(table, dict) for table in tables):
        report(f"lens: must be one table [[lens]] or more, got {short(tables)}")
        return []
    if len(tables) > MOST_LENSES:
        report(f"lens: at most {MOST_LENSES} lenses are supported, got {len(tables)}; leave some out")
        return []
    _check_names(tables, report)
    found = [_read_lens(table, at, medium, problems) for table, at in zip(tables, lens_prefixes(tables), strict=True)]
    lenses = [lens for lens in found if lens is not None]
    count = sum(1 if at is None else len(at) for _, at in lenses)
    if count > MOST_LENSES:
        report(f"lens: at most {MOST_LENSES} lenses are supported, every place of an array counted, got {count}")
    return lenses


def lens_prefixes(tables: list[dict[str, Any]]) -> list[str]:
    """Return the key that leads to each lens: `lens`, or `lens.NAME` where there are several."""
    if len(tables) == 1:
        return ["lens"]
    names = [table.get("name") for table in tables]
    counts = Counter(name for name in names if isinstance(name, str))
    return [
        f"lens.{name}" if isinstance(name, str) and NAME.fullmatch(name) and counts[name] == 1 else f"lens[{place}]"
        for place, name in enumerate(names)
    ]


def _check_names(tables: list[dict[str, Any]], report: Report) -> None:
    seen: set[str] = set()
    for place, table in enumerate(tables):
        at = "lens.name" if len(tables) == 1 else f"lens[{place}].name"
        name = table.get("name")
        if name is None:
            if len(tables) > 1:
                report(f"{at}: is required where there are several lenses, to tell their keys apart")
            continue
        if not isinstance(name, str):
            continue  # its own type is reported with the table
        if not NAME.fullmatch(name):
            report(f"{at}: must be a letter or _, then letters, digits or _, got {short(name)}")
        elif name in LENS_KEYS and name != "mirror":  # which has no parts, so that lens.mirror.r is told from it
            report(f"{at}: must not be a key of the lens table, got {short(name)}")
        elif name in seen:
            report(f"{at}: {short(name)} is the name of an earlier lens; names must differ")
        seen.add(name)


def _read_lens(
    table: dict[str, Any], at: str, medium: Material | None, problems: list[str]
) -> tuple[Lens, Places | None] | None:
    before, report = len(problems), problems.append
    own = dict(table)
    # Parameters are judged against the surface, so an unknown key is told from a wrong number
    formula = own.get("surface")
    if isinstance(formula, str):
        own = _known_keys(own, formula, at, report)
    read = validated(LensTable, own, at, report)
    needs_index = "n" not in own and own.get("mirror") is not True
    if needs_index and read is None:
        report(_no_index(own, at))
    if read is None:
        _check_faces_alone(own, at, report)
        return None
    if read.at is not None and "centre" in read.model_fields_set:
        report(f"{at}.at: only one of the two may be given, {at}.at for an array or {at}.centre for one lens")
    made = _surface(read, at, report)
    if made is None or len(problems) > before:
        if needs_index:
            report(_no_index(own, at))
        return None
    given = plane_values(read.planes) if read.planes is not None else read.model_extra or {}
    values = {parameter.name: given.get(parameter.name, parameter.default) for parameter in made.parameters}
    for key, what in made.problems(values):
        report(f"{at}.{key}: {what}")
    if needs_index:
        report(_no_index(own, at))
    made = _coated(made, read, at, report)
    material = medium if read.n is None else read.n
    if len(problems) > before or material is None:
        return None
    lens = Lens(
        name=read.name,
        formula=read.surface,
        bounds=read.bounds,
        planes=read.planes,
        surface=made,
        values=Frozen(values),
        centre=read.centre if read.at is None else read.at[0],
        stretch=read.stretch,
        rotate=read.rotate,
        material=material,
        absorption=read.absorption,
        absorbs=read.absorbs,
        priority=read.priority,
        mirror=read.mirror,
        has_index=read.n is not None,
    )
    return lens, read.at


def _no_index(table: dict[str, Any], at: str) -> str:
    return f"{at}.n: is required{'; only mirror = true may leave it out' if table.get('mirror') else ''}"


def _coated(made: Surface, read: LensTable, at: str, report: Report) -> Surface:
    """Report what is wrong with a mirror; return the surface in the form whose search tells the coated faces."""
    if read.mirror is True and read.absorbs:
        report(
            f"{at}.mirror: is true, so that no light gets to what {at}.absorbs = true would take; leave out one of the "
            "two, or name the faces that are mirrors: the others absorb"
        )
    if isinstance(read.mirror, bool):
        return made
    _check_faces(made, read.mirror, read.surface, at, report)
    if made.planes and coated_planes(made, read.mirror) is None:
        return replace(made, by_planes=False)
    return made


def _check_faces_alone(table: dict[str, Any], at: str, report: Report) -> None:
    """Report the faces that a surface has not, where other keys of the lens are wrong, too."""
    formula = table.get("surface")
    if not isinstance(formula, str) or formula == "polyhedron":  # whose faces are counted by its planes
        return
    try:
        mirror = check_mirror(table.get("mirror", False))
        is_known = is_catalogue_name(formula)
        own = tuple(sorted(key for key in table if key not in LENS_KEYS))
        made = surface(formula) if is_known else _user_surface(formula, own, _ANYWHERE)
    except (PydanticCustomError, LensclError):  # which is told of in its place
        return
    if not isinstance(mirror, bool):
        _check_faces(made, mirror, formula, at, report)


def _check_faces(made: Surface, mirror: tuple[str, ...], formula: str, at: str, report: Report) -> None:
    known = face_names(made)
    for name in mirror:
        if name not in known:
            listed = ", ".join(short(each) for each in known[:_MOST_NAMED])
            listed += f" and {len(known) - _MOST_NAMED} more" if len(known) > _MOST_NAMED else ""
            near = nearest(name, known)
            hint = near if "did you mean" in near else ""
            report(f"{at}.mirror: {short(name)} is no face of {short(formula)}; its faces are {listed}{hint}")


def _known_keys(table: dict[str, Any], formula: str, at: str, report: Report) -> dict[str, Any]:
    """Report the keys that are neither of the lens table nor parameters of its surface; return the others."""
    extra = [key for key in table if key not in LENS_KEYS]
    if formula in catalogue():
        parameters = [*catalogue()[formula].keys]
    elif is_catalogue_name(formula):
        return {key: value for key, value in table.items() if key in LENS_KEYS}  # no telling: the surface is unknown
    else:
        words = set(NAME.findall(formula))
        parameters = [key for key in extra if key in words and key not in COORDINATES]
        for key in (key for key in extra if key in COORDINATES):
            report(f"{at}.{key}: x, y and z are the coordinates; give the parameter another name")
        extra = [key for key in extra if key not in COORDINATES]
    known = [key for key in LENS_KEYS if key != "planes" or formula == "polyhedron"]  # of the others it is told apart
    own = {*parameters, *LENS_KEYS}
    for key in [key for key in extra if key not in own][:MOST_PROBLEMS]:
        report(unknown_key(at, key, (*parameters, *known)))
    return {key: value for key, value in table.items() if key in own}


def is_catalogue_name(formula: str) -> bool:
    """Return whether a surface is meant as a name of the catalogue, known or not, rather than as an expression."""
    return formula in catalogue() or (bool(NAME.fullmatch(formula)) and formula not in COORDINATES)


def _surface(lens: LensTable, at: str, report: Report) -> Surface | None:
    try:
        if lens.planes is not None and lens.surface != "polyhedron":
            report(f'{at}.planes: is only for surface = "polyhedron"; {short(lens.surface)} has none')
            return None
        if is_catalogue_name(lens.surface):
            if lens.bounds is not None and lens.surface in catalogue():
                report(f"{at}.bounds: is only for expressions; {short(lens.surface)} knows its own")
            if lens.surface == "polyhedron":
                return polyhedron(lens.planes or OCTAHEDRON)
            made = surface(lens.surface)
            return made.with_optional(lens.model_extra or {}) if made.with_optional else made
        made = _user_surface(lens.surface, tuple(sorted(lens.model_extra or {})), lens.bounds or _ANYWHERE)
    except LensclError as error:
        report(f"{at}.surface: {meant_as(lens.surface) or error}")
        return None
    if lens.bounds is None:
        report(f"{at}.bounds: is required for an expression: a box [[x, y, z], [x, y, z]] that holds the solid")
        return None
    return made


@lru_cache(maxsize=64)
def _user_surface(text: str, parameters: tuple[str, ...], bounds: Box) -> Surface:
    """Return the surface of an expression; a sweep over its parameters reads it once."""
    return user_surface(text, parameters, bounds)
