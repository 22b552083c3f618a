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
from lenscl.config.places import MOST_LENSES, At
from lenscl.effects import EFFECTS, WAVELENGTH_LIMITS, Effect
from lenscl.materials import material
from lenscl.methods import METHODS

FORMATS = ("png", "jpg", "tif", "exr")
ENVIRONMENT = "environment"  # in [effects], what fresnel = "split" reflects
_COLOUR = {"type": "array", "items": {"type": "number", "minimum": 0}, "oneOf": [{"maxItems": 1}, {"minItems": 3}],
           "minItems": 1, "maxItems": 3}  # fmt: skip
MODES = ("grid", "latin", "halton", "sobol", "random")
MOST_EVENTS = 255
BY_HAND = ("method", "precision", "snell", "step", "tolerance")  # keys of [numerics] that accuracy chooses
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

    kind: Annotated[str, *_words("point", "parallel")] = Field(
        "point", description="Kind of source: a point, or parallel light."
    )
    at: Vector | None = Field(None, description="Position of the point source.")
    direction: Direction | None = Field(None, description="Direction of parallel light; its length does not matter.")


class FilmTable(Table):
    """The first screen: a parallelogram of pixels that each send one ray."""

    corner: Vector | None = Field(None, description="Outer corner of pixel (0, 0); alternative: centre.")
    centre: Vector | None = Field(None, description="Middle of the film; alternative: corner.")
    right: Direction = Field(description="Vector along a row, from the left edge to the right edge.")
    down: Direction = Field(description="Vector along a column, from the upper edge to the lower edge.")
    scale: Factor = Field(1.0, description="Factor on both spans; the given corner or centre stays in place.")
    size: Size = Field(description="Number of columns and rows.")


class PictureTable(Table):
    """The second screen: a parallelogram that carries an image."""

    corner: Vector | None = Field(None, description="Corner where (s, t) = (0, 0); alternative: centre.")
    centre: Vector | None = Field(None, description="Middle of the picture; alternative: corner.")
    right: Direction = Field(description="Vector along s, over the whole width.")
    down: Direction = Field(description="Vector along t, over the whole height.")
    scale: Factor = Field(1.0, description="Factor on both spans; the given corner or centre stays in place.")
    images: Images | None = Field(None, description="Image files, as paths or patterns relative to the study file.")
    size: Size = Field(
        (1024, 1024),
        description="Columns and rows that define a picture pixel where there is no image, and the cells of caustics.",
    )
    outside: Colour = Field((0.0,), description="Display colour of a ray that misses the picture.")
    filter: Annotated[str, *_words("nearest", "bilinear", "bicubic")] = Field(
        "bilinear", description="Interpolation between the pixels of an image."
    )
    encoding: Annotated[str, *_words("srgb", "linear")] | None = Field(
        None, description="How the image's numbers encode light; by default srgb for integers, linear for floats."
    )
    stops: Annotated[str | bool, *_auto()] = Field(
        "auto", description="Whether the picture is a screen that ends rays; auto: only where it lies on or in a solid."
    )


class MediumTable(Table):
    """The material around the lenses."""

    n: Medium = Field(default_factory=lambda: material("vacuum"), description="Refractive index; vacuum by default.")


class LensTable(Table):
    """One solid; all other keys are the parameters of its surface."""

    model_config = ConfigDict(extra="allow", frozen=True)
    __pydantic_extra__: dict[str, Annotated[float, PlainValidator(checks.Number()), WithJsonSchema({"type": "number"})]]

    name: Text | None = Field(
        None, description="The lens in keys of a sweep, lens.NAME.key; required with several lenses."
    )
    surface: Text = Field(description="A name of the catalogue, or an expression in x, y, z and its own parameters.")
    bounds: Bounds | None = Field(
        None, description="Box that contains the solid of an expression, in lens coordinates."
    )
    planes: Planes | None = Field(
        None,
        description="Planes [a, b, c, d] of a polyhedron; the solid is where a x + b y + c z <= d for all of them.",
    )
    centre: Vector = Field((0.0, 0.0, 0.0), description="Position of the origin of lens coordinates.")
    at: At | None = Field(
        None,
        description="Positions of the copies of a lens array, instead of centre: a list, or a file of rows x, y, z.",
    )
    stretch: Stretch = Field((1.0, 1.0, 1.0), description="Factors along the axes of the lens; negative ones mirror.")
    rotate: Vector = Field((0.0, 0.0, 0.0), description="Angles in degrees about the fixed axes x, then y, then z.")
    n: Medium | None = Field(
        None, description="Refractive index inside. With mirror = true it may be left out: it is that of the medium."
    )
    absorption: Absorption = Field(
        (0.0, 0.0, 0.0),
        description="Absorption coefficients a of red, green and blue, per scene unit: a length L transmits exp(-a L).",
    )
    absorbs: Annotated[bool, *_flag()] = Field(
        False, description="Whether the solid is opaque, as a stop or a mount is."
    )
    mirror: Mirror = Field(
        False, description="Mirrored faces, from both sides: true for all, or names of faces as `lenscl lenses` lists."
    )
    priority: Annotated[float, PlainValidator(checks.Number()), WithJsonSchema({"type": "number"})] = Field(
        0.0, description="Where solids overlap, the one of highest priority is the medium; of equals, the later one."
    )


class NumericsTable(Table):
    """Accuracy, or method and precision."""

    accuracy: Wanted | None = Field(
        None,
        description="Error allowed for 99 % of the rays through a lens: picture pixels with px, else scene units. "
        "Selects the fastest method, precision, snell, step and tolerance.",
    )
    method: Annotated[str, *_words("auto", *METHODS)] = Field(
        "auto", description="Root search: how the next surface is found."
    )
    precision: Annotated[str, *_words("single", "double", "mixed")] = Field(
        "double", description="Floating point precision; mixed: search in single, polish and refract in double."
    )
    snell: Annotated[str, *_words("exact", "paraxial")] = Field(
        "exact", description="Law of refraction: Snell's law, or its paraxial approximation."
    )
    step: Factor = Field(0.01, description="Step of the march, in scene units.")
    tolerance: Factor | None = Field(
        None, description="Bracket width at which the march stops, in scene units; by default 1e-13, in single 1e-6."
    )
    max_events: Annotated[int, *_whole(1, MOST_EVENTS)] = Field(
        64, description="Events after which a ray with one more event is TRAPPED."
    )


class OutputTable(Table):
    """Output files."""

    format: Annotated[str, *_words(*FORMATS)] = Field("png", description="Format of the painted images.")


class SweepTable(Table):
    """Which points a study has; without it a study has one, its scene."""

    mode: Annotated[str, *_words(*MODES)] = Field(
        "grid", description="Every combination of the axes' values, or a sample of the space that they span."
    )
    samples: Annotated[int, *_whole(1, MOST_POINTS)] | None = Field(
        None, description="How many points a sampled mode takes; not for a grid."
    )
    seed: Annotated[int, *_whole(0, 2**63 - 1)] = Field(1, description="Of a sampled mode; equal seeds, equal points.")
    max_points: Annotated[int, *_whole(1, MOST_POINTS)] = Field(
        100_000, description="A sweep of more points than this is refused."
    )
    axes: Any = Field(None, description="The values of each key that varies; the last axis varies fastest.")
    zip: Any = Field(None, description="Groups of axes of equal length that vary together.")
    exclude: Any = Field(None, description="Points to drop: those that match every key of one of these tables.")
    include: Any = Field(None, description="Points to add: keys and values; other keys keep the scene's own values.")


# What a key is for, where no model of pydantic says it
_TITLE = "What the study shows, in a line."
_LENSES = "The lenses: one or more solids, each a table [[lens]]; they may lie in one another, touch or overlap."
_ENVIRONMENT = (
    'What the first surface reflects with fresnel = "split": a colour, an image file, or "picture" (the default).'
)
_EFFECTS_ABOUT = "Optional physics."

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
    properties: dict[str, Any] = {"title": {"type": "string", "description": _TITLE}}
    for name, table in SCENE_TABLES.items():
        properties[name] = _schema(table)
    properties["output"] = _schema(OutputTable)
    lens = _schema(LensTable)
    lens["additionalProperties"] = {"type": "number"}
    lens["anyOf"] = [{"required": ["n"]}, {"properties": {"mirror": {"const": True}}, "required": ["mirror"]}]
    properties["lens"] = {
        "type": "array",
        "description": _LENSES,
        "minItems": 1,
        "maxItems": MOST_LENSES,
        "items": lens,
    }
    properties["effects"] = {
        "type": "object",
        "description": _EFFECTS_ABOUT,
        "additionalProperties": False,
        "properties": {key: _effect_schema(effect) for key, effect in EFFECTS.items()}
        | {
            ENVIRONMENT: {
                "description": _ENVIRONMENT,
                "anyOf": [{"type": "string", "minLength": 1}, {"type": "number", "minimum": 0}, _COLOUR],
            }
        },
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
    words: dict[str, Any] = {"enum": list(effect.choices)}
    about = {"description": f"{effect.model[:1].upper()}{effect.model[1:]}.", "default": effect.default}
    if effect.numbers is None:
        return about | words
    low, high = effect.numbers
    anyway: list[dict[str, Any]] = [words, {"type": "integer", "minimum": low, "maximum": high}]
    if effect.listed is not None:
        (fewest, most), (shortest, longest) = effect.listed, WAVELENGTH_LIMITS
        each = {"type": "number", "minimum": shortest, "maximum": longest}
        anyway.append({"type": "array", "items": each, "minItems": fewest, "maxItems": most})
    return about | {"anyOf": anyway}


def _schema(table: type[Table]) -> dict[str, Any]:
    """Return the schema of one table; a value that may be left out may not be written as null, TOML having none."""
    schema = table.model_json_schema()
    for entry in schema["properties"].values():
        choices = [choice for choice in entry.get("anyOf", ()) if choice != {"type": "null"}]
        if choices:
            del entry["anyOf"]
            entry.update(choices[0] if len(choices) == 1 else {"anyOf": choices})
        if entry.get("default", 0) is None:
            del entry["default"]
    return schema


def _sweep_schema() -> dict[str, Any]:
    about = {key: field.description for key, field in SweepTable.model_fields.items()}
    triple = {"type": "array", "items": {"type": "number"}, "minItems": 3, "maxItems": 3}
    kinds = {
        "linspace": "Start, stop and count of values at equal distances, both ends included.",
        "logspace": "Start, stop and count of values at equal ratios, both ends included; the ends are values.",
        "range": "Start, stop and step; stop is included where a step hits it.",
    }
    shapes: list[dict[str, Any]] = [
        {
            "type": "object",
            "properties": {kind: {"description": meaning, **triple}},
            "required": [kind],
            "additionalProperties": False,
        }
        for kind, meaning in kinds.items()
    ]
    span = {
        "type": "object",
        "properties": {
            "min": {"type": "number", "description": "Least value that a sampled mode draws."},
            "max": {"type": "number", "description": "Greatest value that a sampled mode draws."},
            "scale": {
                "enum": ["linear", "log"],
                "default": "linear",
                "description": "Whether values or their logarithms are drawn evenly.",
            },
        },
        "required": ["min", "max"],
        "additionalProperties": False,
    }
    axes = {"type": "object", "additionalProperties": {"anyOf": [{"type": "array", "minItems": 1}, *shapes, span]}}
    groups = {"type": "array", "items": {"type": "object", "minProperties": 1}}
    properties: dict[str, dict[str, Any]] = {
        "mode": {"enum": list(MODES), "default": "grid"},
        "samples": {"type": "integer", "minimum": 1},
        "seed": {"type": "integer", "minimum": 0, "default": 1},
        "max_points": {"type": "integer", "minimum": 1, "maximum": MOST_POINTS, "default": 100_000},
        "axes": axes,
        "zip": {**groups, "items": axes},
        "exclude": groups,
        "include": groups,
    }
    return {
        "type": "object",
        "description": SweepTable.__doc__,
        "additionalProperties": False,
        "properties": {key: {"description": about[key]} | entry for key, entry in properties.items()},
    }
