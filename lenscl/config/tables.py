"""The tables of a study file as they are written: keys, defaults and what each value may be.

One pydantic model a table; `lens` takes the parameters of its surface beside its own keys. What needs more than one
value to judge (corner or centre, spans that are parallel) is checked in `build`.
"""

from __future__ import annotations

from typing import Annotated, Any

from pydantic import BaseModel, ConfigDict, Field, PlainValidator, WithJsonSchema

from lenscl.config import checks
from lenscl.config.checks import (
    Absorption,
    Bounds,
    Colour,
    Direction,
    Factor,
    Images,
    Medium,
    Mirror,
    Planes,
    Size,
    Stretch,
    Text,
    Vector,
    Wanted,
)
from lenscl.effects import EFFECTS, WAVELENGTH_LIMITS, Effect
from lenscl.materials import material
from lenscl.methods import METHODS

FORMATS = ("png", "jpg", "tif", "exr")
ENVIRONMENT = "environment"  # in [effects], what fresnel = "split" reflects
_COLOUR = {"type": "array", "items": {"type": "number", "minimum": 0}, "oneOf": [{"maxItems": 1}, {"minItems": 3}],
           "minItems": 1, "maxItems": 3}  # fmt: skip
MODES = ("grid", "latin", "halton", "sobol", "random")
MOST_EVENTS = 255
MOST_LENSES = 127  # kernels number them in signed bytes
MOST_POINTS = 10_000_000


def _words(*known: str) -> tuple[PlainValidator, WithJsonSchema]:
    return PlainValidator(checks.OneOf(known)), WithJsonSchema({"type": "string", "enum": list(known)})


def _flag() -> tuple[PlainValidator, WithJsonSchema]:
    return PlainValidator(checks.OneOf((True, False))), WithJsonSchema({"type": "boolean"})


def _auto() -> tuple[PlainValidator, WithJsonSchema]:
    return PlainValidator(checks.OneOf(("auto", True, False))), WithJsonSchema({"enum": ["auto", True, False]})


def _whole(low: int, high: int) -> tuple[PlainValidator, WithJsonSchema]:
    schema = {"type": "integer", "minimum": low, "maximum": high}
    return PlainValidator(checks.Whole(low, high)), WithJsonSchema(schema)


class Table(BaseModel):
    """A table of a study file: unknown keys are errors, values never change."""

    model_config = ConfigDict(extra="forbid", frozen=True)


class SourceTable(Table):
    """Where rays start."""

    kind: Annotated[str, *_words("point", "parallel")] = Field("point", description="A point, or parallel light.")
    at: Vector | None = Field(None, description='Where the point is; for kind = "point".')
    direction: Direction | None = Field(None, description="Where parallel light goes, of any length.")


class FilmTable(Table):
    """The first screen: a parallelogram of pixels that each send one ray."""

    corner: Vector | None = Field(None, description="Outer corner of pixel (0, 0); or give centre.")
    centre: Vector | None = Field(None, description="Middle of the film; or give corner.")
    right: Direction = Field(description="Along a row, its whole width.")
    down: Direction = Field(description="Along a column, its whole height.")
    scale: Factor = Field(1.0, description="Multiplies both spans; corner or centre stays where it was given.")
    size: Size = Field(description="Columns and rows.")


class PictureTable(Table):
    """The second screen: a parallelogram that carries an image."""

    corner: Vector | None = Field(None, description="Where (s, t) = (0, 0); or give centre.")
    centre: Vector | None = Field(None, description="Middle of the picture; or give corner.")
    right: Direction = Field(description="Along s, the whole width.")
    down: Direction = Field(description="Along t, the whole height.")
    scale: Factor = Field(1.0, description="Multiplies both spans; corner or centre stays where it was given.")
    images: Images | None = Field(None, description="Files to paint, as patterns relative to the study file.")
    size: Size = Field((1024, 1024), description="What a picture pixel is where there is no image.")
    outside: Colour = Field((0.0,), description="Colour of a ray that misses the picture.")
    filter: Annotated[str, *_words("nearest", "bilinear", "bicubic")] = Field("bilinear", description="Interpolation.")
    encoding: Annotated[str, *_words("srgb", "linear")] | None = Field(
        None, description="How the image's numbers code light; left out: srgb for whole numbers, linear for floats."
    )
    stops: Annotated[str | bool, *_auto()] = Field(
        "auto", description="Whether rays end where they meet the picture first; auto: where it lies on or in a solid."
    )


class MediumTable(Table):
    """What is between the lenses."""

    n: Medium = Field(default_factory=lambda: material("vacuum"), description="Refractive index; vacuum if left out.")


class LensTable(Table):
    """One solid of glass; keys beside these are the parameters of its surface."""

    model_config = ConfigDict(extra="allow", frozen=True)
    __pydantic_extra__: dict[str, Annotated[float, PlainValidator(checks.Number()), WithJsonSchema({"type": "number"})]]

    name: Text | None = Field(None, description="Needed where there are several lenses.")
    surface: Text = Field(description="A name of the catalogue, or an expression in x, y, z and its own parameters.")
    bounds: Bounds | None = Field(None, description="Box that holds the solid of an expression, in local coordinates.")
    planes: Planes | None = Field(
        None, description="Of a polyhedron: [a, b, c, d] each, the solid being where a x + b y + c z <= d for all."
    )
    centre: Vector = Field((0.0, 0.0, 0.0), description="Where the local origin is.")
    stretch: Stretch = Field((1.0, 1.0, 1.0), description="Factors along the local axes; negative ones mirror.")
    rotate: Vector = Field((0.0, 0.0, 0.0), description="Degrees about the fixed axes x, then y, then z.")
    n: Medium | None = Field(
        None, description="Refractive index inside; with mirror = true that of the medium if left out."
    )
    absorption: Absorption = Field(
        (0.0, 0.0, 0.0), description="Of red, green and blue inside: after a length L exp(-a L) is left."
    )
    absorbs: Annotated[bool, *_flag()] = Field(False, description="Whether it is opaque: a stop, or a mount.")
    mirror: Mirror = Field(
        False, description="Whether all faces are mirrors, from both sides, or which by name: see `lenscl lenses`."
    )
    priority: Annotated[float, PlainValidator(checks.Number()), WithJsonSchema({"type": "number"})] = Field(
        0.0, description="Where solids overlap, the one of higher priority is the medium; of equals, the later one."
    )


class NumericsTable(Table):
    """How accurately to compute: `accuracy`, or by hand."""

    accuracy: Wanted | None = Field(
        None,
        description="How far off rays may land, for 99 % of those through a lens: pixels of the picture with px, else "
        "scene units. Chooses the cheapest method, precision, snell, step and tolerance that meet it.",
    )
    method: Annotated[str, *_words("auto", *METHODS)] = Field("auto", description="How the next surface is found.")
    precision: Annotated[str, *_words("single", "double", "mixed")] = Field(
        "double", description="Floating point numbers used; mixed: found in single, polished and bent in double."
    )
    snell: Annotated[str, *_words("exact", "paraxial")] = Field("exact", description="The law of refraction.")
    step: Factor = Field(0.01, description="Distance between samples of the march, in scene units.")
    tolerance: Factor | None = Field(None, description="Width of a bracket the march accepts, in scene units.")
    max_events: Annotated[int, *_whole(1, MOST_EVENTS)] = Field(64, description="Surfaces met before TRAPPED.")


class OutputTable(Table):
    """What is written."""

    format: Annotated[str, *_words(*FORMATS)] = Field("png", description="Format of the painted images.")


class SweepTable(Table):
    """Which points there are; what the axes may be is checked in `sweep`."""

    mode: Annotated[str, *_words(*MODES)] = "grid"
    samples: Annotated[int, *_whole(1, MOST_POINTS)] | None = None
    seed: Annotated[int, *_whole(0, 2**63 - 1)] = 1
    max_points: Annotated[int, *_whole(1, MOST_POINTS)] = 100_000
    axes: Any = None
    zip: Any = None
    exclude: Any = None
    include: Any = None


SCENE_TABLES: dict[str, type[Table]] = {
    "source": SourceTable,
    "film": FilmTable,
    "picture": PictureTable,
    "medium": MediumTable,
    "numerics": NumericsTable,
}
REQUIRED_TABLES = ("source", "film", "picture", "lens")
# Tables that there are once, and what to do where one is written again; and those that are lists of tables
ONLY_ONE = {
    "source": 'a study has one source: keep one of the two, and let it move by an axis such as "source.at" in '
    "[sweep.axes], or run a study for each",
    "film": 'a study has one film: keep one of the two, and let it vary by an axis such as "film.scale"',
    "picture": "a study has one picture plane: keep one of the two; picture.images takes several files",
    "medium": "one medium is between all lenses: keep one of the two; what lies inside a lens is the lens's own n",
    "effects": "write the keys of all effects in one",
    "numerics": "one method is for all lenses: write its keys in one",
    "output": "a study has one form of output: write its keys in one",
    "sweep": "a study has one sweep: write its keys in one, and its axes in [sweep.axes]",
    "sweep.axes": "write all axes in one; those that vary together are tables [[sweep.zip]]",
}
LISTS = ("lens", "sweep.zip", "sweep.exclude", "sweep.include")
TOP_KEYS = ("title", "source", "film", "picture", "medium", "lens", "effects", "numerics", "sweep", "output")


def study_schema() -> dict[str, Any]:
    """Return the JSON schema of a study file (draft 2020-12), for editors."""
    properties: dict[str, Any] = {"title": {"type": "string"}}
    for name, table in SCENE_TABLES.items():
        properties[name] = _schema(table)
    properties["output"] = _schema(OutputTable)
    lens = _schema(LensTable)
    lens["additionalProperties"] = {"type": "number"}
    lens["anyOf"] = [{"required": ["n"]}, {"properties": {"mirror": {"const": True}}, "required": ["mirror"]}]
    properties["lens"] = {"type": "array", "minItems": 1, "maxItems": MOST_LENSES, "items": lens}
    properties["effects"] = {
        "type": "object",
        "additionalProperties": False,
        "properties": {key: _effect_schema(effect) for key, effect in EFFECTS.items()}
        | {ENVIRONMENT: {"anyOf": [{"type": "string", "minLength": 1}, {"type": "number", "minimum": 0}, _COLOUR]}},
    }
    return {
        "$schema": "https://json-schema.org/draft/2020-12/schema",
        "title": "lenscl study",
        "type": "object",
        "required": list(REQUIRED_TABLES),
        "additionalProperties": False,
        "properties": {key: properties[key] for key in TOP_KEYS if key in properties} | {"sweep": _sweep_schema()},
    }


def _effect_schema(effect: Effect) -> dict[str, Any]:
    words = {"enum": list(effect.choices)}
    if effect.numbers is None:
        return words
    low, high = effect.numbers
    anyway: list[dict[str, Any]] = [words, {"type": "integer", "minimum": low, "maximum": high}]
    if effect.listed is not None:
        (fewest, most), (shortest, longest) = effect.listed, WAVELENGTH_LIMITS
        each = {"type": "number", "minimum": shortest, "maximum": longest}
        anyway.append({"type": "array", "items": each, "minItems": fewest, "maxItems": most})
    return {"anyOf": anyway}


def _schema(table: type[Table]) -> dict[str, Any]:
    """Return the schema of one table; a value that may be left out may not be written as null, TOML having none."""
    schema = table.model_json_schema()
    for key, entry in schema["properties"].items():
        choices = [choice for choice in entry.get("anyOf", ()) if choice != {"type": "null"}]
        if choices:
            del entry["anyOf"]
            entry.update(choices[0] if len(choices) == 1 else {"anyOf": choices})
        if entry.get("default", 0) is None:
            del entry["default"]
        entry.setdefault("description", key)
    return schema


def _sweep_schema() -> dict[str, Any]:
    triple = {"type": "array", "items": {"type": "number"}, "minItems": 3, "maxItems": 3}
    shapes: list[dict[str, Any]] = [
        {"type": "object", "properties": {kind: triple}, "required": [kind], "additionalProperties": False}
        for kind in ("linspace", "logspace", "range")
    ]
    span = {
        "type": "object",
        "properties": {
            "min": {"type": "number"},
            "max": {"type": "number"},
            "scale": {"enum": ["linear", "log"]},
        },
        "required": ["min", "max"],
        "additionalProperties": False,
    }
    axes = {"type": "object", "additionalProperties": {"anyOf": [{"type": "array", "minItems": 1}, *shapes, span]}}
    groups = {"type": "array", "items": {"type": "object", "minProperties": 1}}
    return {
        "type": "object",
        "additionalProperties": False,
        "properties": {
            "mode": {"enum": list(MODES)},
            "samples": {"type": "integer", "minimum": 1},
            "seed": {"type": "integer", "minimum": 0},
            "max_points": {"type": "integer", "minimum": 1, "maximum": MOST_POINTS},
            "axes": axes,
            "zip": {**groups, "items": axes},
            "exclude": groups,
            "include": groups,
        },
    }
