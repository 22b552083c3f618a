"""Write the pages of the documentation that come from code: keys of a study, commands, lenses, materials.

Input: the JSON schema, the click commands and the catalogues. Output: Markdown in docs/generated, made at each build
and not kept in the repository. A key, command, lens or material that is added to the program is in the pages of the
next build.
"""

from __future__ import annotations

import json
import re
from collections.abc import Callable, Iterator, Mapping
from pathlib import Path
from typing import Any

import click

from lenscl.cli import main
from lenscl.config import study_schema
from lenscl.effects import EFFECTS
from lenscl.lenses import Parameter, Surface, catalogue, face_names
from lenscl.materials import CATALOGUE

Schema = Mapping[str, Any]
TABLES = ("source", "film", "picture", "medium", "lens", "effects", "numerics", "sweep", "output")


def write_all(folder: Path) -> None:
    """Write every generated page. A file whose text stays the same is not touched, so Sphinx does not read it again."""
    folder.mkdir(exist_ok=True)
    for name, page in PAGES.items():
        file, text = folder / f"{name}.md", "\n".join(page()) + "\n"
        if not file.is_file() or file.read_text(encoding="utf-8") != text:
            file.write_text(text, encoding="utf-8")


def _cell(text: str) -> str:
    """Return text that may stand in a cell of a Markdown table."""
    return text.replace("|", "\\|").replace("<", "&lt;").replace("\n", " ")


def _value(value: Any) -> str:
    """Spell a value as TOML does."""
    return json.dumps(value)


def kind_of(schema: Schema) -> str:
    """Say in a few words what a key may be."""
    if "anyOf" in schema:
        return "; or ".join(dict.fromkeys(kind_of(each) for each in schema["anyOf"]))
    if "enum" in schema:
        return " or ".join(f"`{_value(each)}`" for each in schema["enum"])
    if "const" in schema:
        return f"`{_value(schema['const'])}`"
    return _KINDS[schema["type"]](schema)


def _number_kind(schema: Schema) -> str:
    what = "whole number" if schema["type"] == "integer" else "number"
    low, above, high = (schema.get(key) for key in ("minimum", "exclusiveMinimum", "maximum"))
    lower = f" more than {above:g}" if above is not None else f" from {low:g}" if low is not None else ""
    return f"{what}{lower}{f' to {high:g}' if high is not None else ''}"


def _array_kind(schema: Schema) -> str:
    least, most = schema.get("minItems"), schema.get("maxItems")
    count = f"{least} " if least == most and least else f"{least} to {most} " if least and most else ""
    inner = kind_of(schema["items"]) if "items" in schema else "number"
    plural = re.sub(r"^(whole number|number|text|list|table)\b", r"\1s", inner)
    return f"list of {count}{plural}"


def _object_kind(schema: Schema) -> str:
    keys = schema.get("properties", {})
    return f"table `{{ {', '.join(f'{key} = ...' for key in keys)} }}`" if keys else "table"


_KINDS: dict[str, Callable[[Schema], str]] = {
    "number": _number_kind,
    "integer": _number_kind,
    "boolean": lambda schema: "`true` or `false`",
    "string": lambda schema: "text",
    "array": _array_kind,
    "object": _object_kind,
}


def _study_keys() -> Iterator[str]:
    schema = study_schema()
    yield "| key | value | default | meaning |\n|---|---|---|---|"
    yield f"| `title` | text | | {_cell(schema['properties']['title']['description'])} |\n"
    for name in TABLES:
        table = schema["properties"][name]
        heading = f"[[{name}]]" if table.get("type") == "array" else f"[{name}]"
        entries = table.get("items", table)
        yield f"### `{heading}`\n"
        yield f"{entries['description'].replace(chr(10), ' ')}\n"
        yield "| key | value | default | meaning |\n|---|---|---|---|"
        required = entries.get("required", ())
        for key, entry in entries["properties"].items():
            default = "required" if key in required else f"`{_value(entry['default'])}`" if "default" in entry else ""
            yield f"| `{key}` | {_cell(kind_of(entry))} | {_cell(default)} | {_cell(entry['description'])} |"
        yield ""


def _effect_keys() -> Iterator[str]:
    entries = study_schema()["properties"]["effects"]["properties"]
    yield "| key | values | default | model |\n|---|---|---|---|"
    for key, entry in entries.items():
        default = f"`{_value(entry['default'])}`" if "default" in entry else '`"picture"`'
        yield f"| `{key}` | {_cell(kind_of(entry))} | {default} | {_cell(entry['description'])} |"


def _effect_arrays() -> Iterator[str]:
    yield "| array | effect | meaning |\n|---|---|---|"
    for key, effect in EFFECTS.items():
        outputs = dict.fromkeys(out for variants in effect.variants.values() for one in variants for out in one.adds)
        for output in outputs:
            shape = f"; of shape {output.pixel_shape} a pixel" if output.pixel_shape else ""
            yield f"| `{output.name}` | `{key}` | {_cell(output.meaning)}{shape} |"
    yield "| `magnification` | `footprint` | area of the footprint, divided by the area of the film pixel |"
    yield "| `fold` | `footprint` | 1 where the picture is seen as it is, -1 where it is mirrored, 0 without a place |"
    yield "| `wavelengths` | `dispersion` | wavelengths, nm; all arrays of rays then have an axis of them in front |"
    yield "| `samples` | `antialias` | the further rays of film pixels |"
    yield "| `irradiance`, `caustic` | `caustics` | light on the cells of the picture; energy balance |"


def _commands() -> Iterator[str]:
    for name, command in main.commands.items():
        context = click.Context(command, info_name=f"lenscl {name}")
        usage = command.get_usage(context).removeprefix("Usage: ")
        yield f"## `lenscl {name}`\n"
        yield f"```text\n{usage}\n```\n"
        yield from _paragraphs(command.help or "")
        yield "| option | meaning |\n|---|---|"
        for parameter in command.params:
            record = parameter.get_help_record(context)
            if record is not None and isinstance(parameter, click.Option):
                yield f"| `{_cell(record[0])}` | {_cell(record[1])} |"
        yield "| `-h, --help` | Show the help and exit. |\n"


def _paragraphs(text: str) -> Iterator[str]:
    """Yield a command's help as Markdown; its example is code."""
    for paragraph in re.split(r"\n\s*\n", text.strip()):
        if "\b" in paragraph:
            lines = [line.strip() for line in paragraph.replace("\b", "").strip().splitlines()]
            yield "\n".join(["```bash", *lines[1:], "```", ""])
        else:
            yield " ".join(paragraph.split()).replace("<", "\\<").replace("*", "\\*") + "\n"


def _anchor(name: str) -> str:
    """Return the anchor of a heading, as Sphinx makes it."""
    return name.replace("_", "-")


def _lenses() -> Iterator[str]:
    surfaces = catalogue()
    yield "::::{container} thumbnails"
    for name in surfaces:
        yield f':::{{figure}} pictures/lenses/{name}.jpg\n:alt: {name}\n:target: "#{_anchor(name)}"\n\n{name}\n:::'
    yield "::::\n"
    for name, surface in surfaces.items():
        yield f"### {name}\n"
        yield f"![A cat through the surface {name}](pictures/lenses/{name}.jpg){{.lens-picture}}\n"
        yield f"{surface.summary[:1].upper()}{surface.summary[1:]}.\n"
        yield f"```text\n{surface.formula}\n```\n"
        yield from _parameters(surface)
        yield f"Faces: {_faces(surface)}.\n"
        yield f"Source: {surface.source}.\n".replace("*", "\\*")


def _faces(surface: Surface) -> str:
    if surface.given_as:
        return f"`1`, `2`, ..., the places in `{surface.given_as}`"
    return ", ".join(f"`{name}`" for name in face_names(surface))


def _parameters(surface: Surface) -> Iterator[str]:
    if surface.given_as:
        yield f"Its numbers are given as a list, `{surface.given_as} = [[a, b, c, d], ...]`.\n"
        return
    every: dict[str, Parameter] = {each.name: each for each in (*surface.parameters, *surface.optional)}
    if not every:
        yield "It has no parameters.\n"
        return
    yield "| parameter | default | range | meaning |\n|---|---|---|---|"
    for name, parameter in every.items():
        optional = name in {each.name for each in surface.optional}
        default = "left out" if optional else f"`{parameter.default:g}`"
        yield f"| `{name}` | {default} | {parameter.range_text()} | {_cell(parameter.meaning)} |"
    yield ""


def _materials() -> Iterator[str]:
    yield "| name | other names | index at the d line | data | source |\n|---|---|---|---|---|"
    for name, material in CATALOGUE.items():
        aliases = ", ".join(f"`{alias}`" for alias in material.aliases)
        kind = type(material.index).__name__.lower()
        yield f"| `{name}` | {aliases} | {material.n:.5f} | {kind} | {_cell(material.source)} |"


PAGES: dict[str, Callable[[], Iterator[str]]] = {
    "study-keys": _study_keys,
    "effect-keys": _effect_keys,
    "effect-arrays": _effect_arrays,
    "commands": _commands,
    "lenses": _lenses,
    "materials": _materials,
}
