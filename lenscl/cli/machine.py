"""The commands about this machine and this program: lenses, devices, doctor."""
# ruff: noqa: D301 - a backspace, not an escaped one, tells click to leave a paragraph as it is

from __future__ import annotations

import json
from collections.abc import Iterator
from typing import TYPE_CHECKING, Any

import click

from lenscl.cli.group import json_option

if TYPE_CHECKING:
    from lenscl.lenses import Parameter, Surface


@click.command()
@json_option
def lenses(as_json: bool) -> None:
    """List the catalogue of surfaces.

    Each surface has its parameters with ranges and defaults, its faces, its formula, and the source of that.

    The key mirror of a lens takes names of faces, as in mirror = ["back"]. The faces of an expression are the operands
    of its outermost max, by number: "1", "2", ...

    \b
    Example:
      lenscl lenses
      lenscl lenses --json
    """
    from lenscl.lenses import catalogue

    surfaces = catalogue().values()
    if as_json:
        click.echo(json.dumps([_described(surface) for surface in surfaces], indent=2))
        return
    for surface in surfaces:
        click.echo(f"{surface.name}: {surface.summary}")
        for line in _lines(surface):
            click.echo(f"    {line}")


@click.command()
@json_option
def devices(as_json: bool) -> None:
    """List the OpenCL devices, best first.

    The device that would be chosen is marked. The environment variable LENSCL_DEVICE selects another one: part of a
    device's label, in any case of letters.

    \b
    Example:
      lenscl devices
      LENSCL_DEVICE=pocl lenscl devices --json
    """
    from lenscl import device

    chosen = device.choose()
    found = [
        {
            "device": one.label,
            "chosen": one == chosen,
            "kind": one.kind,
            "driver": one.driver,
            "double": one.has_double,
            "width": {"single": one.width("single"), "double": one.width("double")},
        }
        for one in device.devices()
    ]
    if as_json:
        click.echo(json.dumps(found, indent=2))
        return
    for one in device.devices():
        single, double = one.width("single"), one.width("double") if one.has_double else "none"
        click.echo(f"{'*' if one == chosen else ' '} {one.label}")
        click.echo(f"    {one.kind}, {one.driver}, rays a packet: single {single}, double {double}")
    click.echo("* would be chosen; LENSCL_DEVICE=NAME takes another", err=True)


@click.command()
@json_option
def doctor(as_json: bool) -> None:
    """Test this machine and say how to fix what fails.

    It tests the driver, the linker, the cache folder, a kernel that is compiled and compared in a process of its own,
    image formats, limits, disk and extras. The exit code is 4 if no device works, 1 if anything else fails.

    \b
    Example:
      lenscl doctor
      lenscl doctor --json
    """
    from lenscl.cli.health import FAULT, examine
    from lenscl.errors import LensclError, NoDeviceError

    found = []
    for finding in examine():
        found.append(finding)
        if not as_json:
            click.echo(f"{finding.state:5} {finding.what}: {finding.detail}")
            if finding.fix:
                click.echo(f"      fix: {finding.fix}")
    if as_json:
        click.echo(json.dumps([finding.as_dict() for finding in found], indent=2))
    faults = [finding for finding in found if finding.state == FAULT]
    if any(finding.is_device for finding in faults):
        raise SystemExit(NoDeviceError.exit_code)
    if faults:
        raise SystemExit(LensclError.exit_code)


def _lines(surface: Surface) -> Iterator[str]:
    from lenscl.lenses import FEWEST_PLANES, MOST_PLANES, OCTAHEDRON

    yield surface.formula
    if surface.given_as:
        yield f"{surface.given_as} = {[list(plane) for plane in OCTAHEDRON]}: {FEWEST_PLANES} to {MOST_PLANES} of them"
    for parameter in surface.parameters:
        low = "(" if parameter.low_open else "["
        values = f"{parameter.default:g} in {low}{parameter.low:g}, {parameter.high:g}]"
        yield f"{parameter.name} = {values}: {parameter.meaning}"
    for first, last, meaning in _ranges(surface):
        yield f"{first} ... {last} = 0 where left out: {meaning}"
    yield f"faces: {_faces(surface)}"
    yield f"source: {surface.source}"


def _faces(surface: Surface) -> str:
    """Return the names of the faces, as a mirror may name them."""
    from lenscl.lenses import face_names

    names = face_names(surface)
    if surface.given_as:
        return f'"1" ... "N", by their places in {surface.given_as}'
    return ", ".join(f'"{name}"' for name in names)


def _ranges(surface: Surface) -> Iterator[tuple[str, str, str]]:
    """Yield the optional parameters that differ in a number only: the first, the last, and what the first is."""
    letters = dict.fromkeys(parameter.name.rstrip("0123456789") for parameter in surface.optional)
    for letter in letters:
        own = [each for each in surface.optional if each.name.rstrip("0123456789") == letter]
        yield own[0].name, own[-1].name, own[0].meaning.replace("r^1 ", "r^1 and so on ")


def _described(surface: Surface) -> dict[str, Any]:
    from lenscl.lenses import OCTAHEDRON, face_names

    return {
        "name": surface.name,
        "summary": surface.summary,
        "formula": surface.formula,
        "source": surface.source,
        "faces": list(face_names(surface)),
        "parameters": [_number(parameter) for parameter in surface.parameters],
        **({"optional": [_number(parameter) for parameter in surface.optional]} if surface.optional else {}),
        **({surface.given_as: [list(plane) for plane in OCTAHEDRON]} if surface.given_as else {}),
    }


def _number(parameter: Parameter) -> dict[str, Any]:
    return {
        "name": parameter.name,
        "default": parameter.default,
        "low": parameter.low,
        "high": parameter.high,
        "low_open": parameter.low_open,
        "meaning": parameter.meaning,
    }
