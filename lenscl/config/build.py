"""From the tables of a study file to a Scene, with every problem found on the way.

Input: a document, nested dictionaries as tomllib reads them. Output: a Scene, or a StudyError that names every key.
"""

from __future__ import annotations

import math
import re
from collections import Counter
from collections.abc import Callable, Mapping
from dataclasses import replace
from functools import lru_cache
from typing import Any, Literal, TypeVar, cast

from pydantic import ValidationError
from pydantic_core import PydanticCustomError

from lenscl.config.checks import LONGEST, SHORTEST, Box, Vec3, check_mirror, check_wavelengths
from lenscl.config.lens import Lens, Lenses
from lenscl.config.places import MOST_LENSES, Places
from lenscl.config.problems import (
    MOST_PROBLEMS,
    as_plain,
    from_pydantic,
    key_text,
    nearest,
    short,
    study_error,
    unknown_key,
)
from lenscl.config.scene import Effects, Film, Frozen, Numerics, Picture, Scene, Source
from lenscl.config.tables import (
    ENVIRONMENT,
    ONLY_ONE,
    FilmTable,
    LensTable,
    MediumTable,
    NumericsTable,
    PictureTable,
    SourceTable,
    Table,
)
from lenscl.effects import EFFECTS, Value
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
from lenscl.materials import Material, index_problems

T = TypeVar("T", bound=Table)
Report = Callable[[str], None]  # takes one problem, led by its key

NAME = re.compile(r"[A-Za-z_][A-Za-z0-9_]*")
COORDINATES = ("x", "y", "z")
LENS_KEYS = tuple(LensTable.model_fields)
_ANYWHERE: Box = ((-1.0,) * 3, (1.0,) * 3)  # stands for bounds that are missing, while an expression is read
_BRIGHTEST = 1e30  # of a colour: decoded from sRGB it is still a number
_MOST_NAMED = 24  # faces that a message lists
_PARALLEL = 4 * 2.0**-52  # sine of the angle of two spans that differ by rounding alone
BY_HAND = ("method", "precision", "snell", "step", "tolerance")  # keys of [numerics] that accuracy chooses


def scene_from_document(document: Mapping[str, Any]) -> Scene:
    """Return the scene of a document; tables that are no part of a scene are ignored.

    Raises
    ------
    StudyError
        With every problem found.
    """
    problems: list[str] = []
    scene = read_scene(document, problems)
    if scene is None:
        raise study_error(problems)
    return scene


def read_scene(document: Mapping[str, Any], problems: list[str]) -> Scene | None:
    """Return the scene of a document, or None after at least one problem was reported."""
    before, report = len(problems), problems.append
    source = read_table(SourceTable, document, "source", report)
    film = read_table(FilmTable, document, "film", report)
    picture = read_table(PictureTable, document, "picture", report)
    medium = read_table(MediumTable, document, "medium", report)
    numerics = _read_numerics(document, report)
    effects = _read_effects(document, report)
    environment = _read_environment(document, report)
    lenses = _read_lenses(document, None if medium is None else medium.n, problems)
    if source is not None:
        _check_source(source, report)
    if film is not None:
        _check_screen("film", film, report)
    if picture is not None:
        _check_screen("picture", picture, report)
    if source is None or film is None or picture is None or medium is None or numerics is None:
        return None
    if len(problems) > before:
        return None
    scene = Scene(
        source=Source(kind=cast(Literal["point", "parallel"], source.kind), at=source.at, direction=source.direction),
        film=Film(**_screen(film)),
        picture=Picture(
            **_screen(picture),
            images=picture.images,
            outside=picture.outside,
            filter=cast(Literal["nearest", "bilinear", "bicubic"], picture.filter),
            encoding=cast(Literal["srgb", "linear"] | None, picture.encoding),
            stops=cast(Literal["auto"] | bool, picture.stops),
        ),
        medium=medium.n,
        lenses=Lenses(lenses),
        effects=effects,
        numerics=numerics,
        environment=environment,
    )
    _check_indices(scene, lens_prefixes(document["lens"]), report)
    return None if len(problems) > before else scene


def _check_indices(scene: Scene, prefixes: list[str], report: Report) -> None:
    """Report the materials of which the index is not known at a wavelength that the scene is traced at."""
    materials = {"medium.n": scene.medium}
    materials |= {
        f"{at}.n": group.lens.material
        for at, group in zip(prefixes, scene.lenses.groups, strict=True)
        if group.lens.has_index
    }
    asks = f"effects.dispersion = {short(scene.effects['dispersion'])} needs it there"
    for key, material in materials.items():
        found = [problem for nm in scene.wavelengths for problem in index_problems(material.index, nm)]
        if found:
            report(f"{key}: {found[0]}; {asks}: give data that reach so far, or one number, or leave the effect out")


def read_table(model: type[T], document: Mapping[str, Any], at: str, report: Report) -> T | None:
    """Return one table of the document; a table left out counts as empty."""
    table = document.get(at, {})
    if not isinstance(table, dict):
        report(_no_table(at, table))
        return None
    if at not in document and any(field.is_required() for field in model.model_fields.values()):
        report(f"{at}: is required; add a table [{at}]")
        return None
    return _read(model, table, at, report)


def _no_table(at: str, value: Any) -> str:
    """Return the problem of what stands where a table is wanted."""
    if isinstance(value, list) and value and all(isinstance(entry, dict) for entry in value):
        if len(value) == 1:
            return f"{at}: is a single table, written [{at}], with single brackets"
        return f"{at}: is a single table, written [{at}], and here are {len(value)} of it; {ONLY_ONE[at]}"
    return f"{at}: must be a table [{at}], got {short(value)}"


def _read(model: type[T], table: dict[str, Any], at: str, report: Report) -> T | None:
    try:
        return model.model_validate(table)
    except ValidationError as error:
        for problem in from_pydantic(error, at, model.model_fields):
            report(problem)
    return None


def _check_source(source: SourceTable, report: Report) -> None:
    wanted, idle = ("at", "direction") if source.kind == "point" else ("direction", "at")
    if getattr(source, wanted) is None:
        report(f"source.{wanted}: is required where source.kind is {short(source.kind)}")
    if getattr(source, idle) is not None:
        other = "parallel" if source.kind == "point" else "point"
        report(f'source.{idle}: is read only where source.kind is "{other}"; leave it out or change source.kind')


def _check_screen(at: str, screen: FilmTable | PictureTable, report: Report) -> None:
    if (screen.corner is None) == (screen.centre is None):
        what = "only one of the two may be given" if screen.corner is not None else "one of the two is required"
        report(f"{at}.corner: {what}, {at}.corner or {at}.centre")
    for key in ("right", "down"):
        span: Vec3 = getattr(screen, key)
        length = math.hypot(*span) * screen.scale
        if not SHORTEST <= length <= 2 * LONGEST:
            report(f"{at}.scale: makes {at}.{key} {length:g} long; it must lie from {SHORTEST:g} to {LONGEST:g}")
            break
    if _sine(screen.right, screen.down) <= _PARALLEL:
        report(f"{at}.down: is parallel to {at}.right; the two must span a parallelogram")


def _sine(a: Vec3, b: Vec3) -> float:
    """Return the sine of the angle of two vectors, exact to rounding however small it is."""
    p, q = (tuple(x / math.hypot(*v) for x in v) for v in (a, b))
    return math.hypot(p[1] * q[2] - p[2] * q[1], p[2] * q[0] - p[0] * q[2], p[0] * q[1] - p[1] * q[0])


def _screen(table: FilmTable | PictureTable) -> dict[str, Any]:
    keeps = "corner" if table.corner is not None else "centre"
    return {
        "keeps": keeps,
        "anchor": getattr(table, keeps),
        "unscaled_right": table.right,
        "unscaled_down": table.down,
        "scale": table.scale,
        "size": table.size,
    }


def _read_numerics(document: Mapping[str, Any], report: Report) -> Numerics | None:
    table = document.get("numerics")
    if isinstance(table, dict) and "accuracy" in table:
        clash = [key for key in BY_HAND if key in table]
        if clash:
            report(f"numerics.accuracy: chooses {' and '.join(clash)} itself; give either accuracy or those")
    read = read_table(NumericsTable, document, "numerics", report)
    return None if read is None else Numerics(**{key: getattr(read, key) for key in NumericsTable.model_fields})


def _read_effects(document: Mapping[str, Any], report: Report) -> Effects:
    table = document.get("effects", {})
    if not isinstance(table, dict):
        report(_no_table("effects", table))
        table = {}
    asked: dict[str, Value] = {key: effect.default for key, effect in EFFECTS.items()}
    for key, value in table.items():
        if key == ENVIRONMENT:
            continue
        if key in EFFECTS:
            choices, numbers, listed = EFFECTS[key].choices, EFFECTS[key].numbers, EFFECTS[key].listed
            value = _counted(value) if numbers else value
            if listed and isinstance(value, list | tuple):
                try:
                    asked[key] = check_wavelengths(value)
                except PydanticCustomError as error:
                    report(f"effects.{key}: {error.message()}")
            elif not EFFECTS[key].takes(value):
                words = [choice for choice in choices if isinstance(choice, str)]
                hint = nearest(value, words) if isinstance(value, str) and words else ""
                says = " or ".join(short(choice) for choice in choices)
                says += f" or a whole number from {numbers[0]} to {numbers[1]}" if numbers else ""
                says += f" or a rising list of {listed[0]} to {listed[1]} wavelengths in nm" if listed else ""
                hint = hint if "did you mean" in hint else ""
                if listed and isinstance(value, float):
                    hint = f"; a single wavelength is a list, too, [{short(value)}]"
                report(f"effects.{key}: must be {says}, got {short(value)}{hint}")
            else:
                asked[key] = value
        else:
            report(unknown_key("effects", key, (*EFFECTS, ENVIRONMENT)))
    return Effects(asked)


def _read_environment(document: Mapping[str, Any], report: Report) -> str | tuple[float, ...]:
    """Return what lenses reflect."""
    table = document.get("effects", {})
    value = as_plain(table.get(ENVIRONMENT, "picture")) if isinstance(table, dict) else "picture"
    if isinstance(value, str) and value and "\0" not in value:
        return value
    numbers = [value] if isinstance(value, (int, float)) and not isinstance(value, bool) else value
    if isinstance(numbers, (list, tuple)) and len(numbers) in (1, 3):
        finite = [each for each in numbers if type(each) in (int, float) and 0 <= each <= _BRIGHTEST]
        if len(finite) == len(numbers):
            return tuple(float(each) for each in finite)
    report(
        f'effects.{ENVIRONMENT}: must be "picture", the path of an image, or a colour of 1 or 3 numbers from 0 to '
        f"{_BRIGHTEST:g}, got {short(value)}"
    )
    return "picture"


def _counted(value: Any) -> Any:
    """Return 8.0 as 8, as other whole numbers of a study may be written, and anything else as it is."""
    value = as_plain(value)
    return int(value) if isinstance(value, float) and value.is_integer() else value


def _read_lenses(
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
    read = _read(LensTable, own, at, report)
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


def unknown_top_keys(document: Mapping[str, Any], known: tuple[str, ...], report: Report) -> None:
    """Report the tables and keys that no study has."""
    for key in [key for key in document if key not in known][:MOST_PROBLEMS]:
        report(unknown_key("", key, known))
