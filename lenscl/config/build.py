"""From the tables of a study file to a Scene, with every problem found on the way.

Input: a document, nested dictionaries as tomllib reads them. Output: a Scene, or a StudyError that names every key.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any, Literal, TypeVar, cast

from pydantic_core import PydanticCustomError

from lenscl.config.checks import LONGEST, SHORTEST, Vec3, check_wavelengths
from lenscl.config.lens import Lenses
from lenscl.config.problems import (
    MOST_PROBLEMS,
    Report,
    as_plain,
    nearest,
    short,
    study_error,
    unknown_key,
    validated,
)
from lenscl.config.read_lenses import lens_prefixes, read_lenses
from lenscl.config.scene import Effects, Film, Numerics, Picture, Scene, Source
from lenscl.config.tables import (
    BY_HAND,
    ENVIRONMENT,
    ONLY_ONE,
    FilmTable,
    MediumTable,
    NumericsTable,
    PictureTable,
    SourceTable,
    Table,
)
from lenscl.effects import EFFECTS, Value
from lenscl.materials import index_problems

T = TypeVar("T", bound=Table)

_BRIGHTEST = 1e30  # of a colour: decoded from sRGB it is still a number
_PARALLEL = 4 * 2.0**-52  # sine of the angle of two spans that differ by rounding alone


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
    lenses = read_lenses(document, None if medium is None else medium.n, problems)
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
    return validated(model, table, at, report)


def _no_table(at: str, value: Any) -> str:
    """Return the problem of what stands where a table is wanted."""
    if isinstance(value, list) and value and all(isinstance(entry, dict) for entry in value):
        if len(value) == 1:
            return f"{at}: is a single table, written [{at}], with single brackets"
        return f"{at}: is a single table, written [{at}], and here are {len(value)} of it; {ONLY_ONE[at]}"
    return f"{at}: must be a table [{at}], got {short(value)}"


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


def unknown_top_keys(document: Mapping[str, Any], known: tuple[str, ...], report: Report) -> None:
    """Report the tables and keys that no study has."""
    for key in [key for key in document if key not in known][:MOST_PROBLEMS]:
        report(unknown_key("", key, known))
