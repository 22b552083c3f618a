"""What was meant by a surface's text that is neither a name of the catalogue nor an expression: a file, a name."""

from __future__ import annotations

import difflib
import re

from lenscl.expr import FUNCTIONS
from lenscl.lenses.named import catalogue

_EXPRESSION = 'write an expression in x, y and z, negative inside, such as "x^2 + y^2 + z^2 - 1", with its bounds'
_WAYS = f"write a name of the catalogue, which `lenscl lenses` lists, or {_EXPRESSION.removeprefix('write ')}"
# Meshes, solids of CAD programs, scenes and volumes
_FILES = (
    *("stl", "obj", "ply", "glb", "gltf", "off", "3mf", "amf", "dae", "fbx", "3ds", "blend", "usd", "usda", "usdc"),
    *("usdz", "abc", "x3d", "wrl", "vrml", "msh", "vtk", "vtp", "xyz", "pcd", "step", "stp", "iges", "igs", "brep"),
    *("sat", "f3d", "ipt", "sldprt", "skp", "dxf", "dwg", "scad", "3dm", "vdb", "zmx", "zos", "zar", "seq", "len"),
    *("pov", "inc", "mtl", "frag", "glsl", "py", "json", "toml", "yaml", "csv", "txt", "png", "jpg", "jpeg", "exr"),
)
_FILE_NAME = re.compile(r"(?:[\w./\\:~ -]*[^\w.])?[A-Za-z_]\w*\.([A-Za-z]\w{0,7})\s*")
_ANY_FILE = re.compile(r".*\.([A-Za-z0-9]{1,8})\s*", re.DOTALL)
_LONGEST_SHOWN = 60
_LONGEST = 4096  # of a path
_PATH = re.compile(
    r"\s*(?:\.{1,2}[/\\].*|~?[/\\][\w.].+|[A-Za-z]:[/\\].*|[A-Za-z][\w.-]{2,}(?:[/\\][A-Za-z][\w.-]{2,})+)"
)
_WORDS = re.compile(r"\s*[A-Za-z]\w*(?:[\s-]+[A-Za-z]\w*)*\s*", re.ASCII)
_CALL = re.compile(r"\s*([A-Za-z]\w*)\s*\(")
_MODULES = ("math", "np", "numpy", "cmath", "sympy", "sp", "jnp", "torch")


def meant_as(text: str) -> str | None:
    """Return what to say of a surface's text that does not read as an expression; None where its column says it best.

    Parameters
    ----------
    text : str
        The value of `surface`.
    """
    if not text.strip():
        return f"is empty; {_WAYS}"
    if re.match(r"\s*[A-Za-z][A-Za-z0-9+.-]+:/", text):
        return f"{_quoted(text)} is an address, and nothing is fetched; {_WAYS}"
    if _is_file(text):
        stem = re.split(r"[/\\]", text.strip())[-1].rpartition(".")[0]
        near = _or(nearest_surface(stem))
        return f"{_quoted(text)} looks like the name of a file, and files of meshes are not read{near}; {_WAYS}"
    if _WORDS.fullmatch(text) and len(text.strip()) > 1:
        if (name := nearest_surface(text)) is not None:
            return f'unknown surface {_quoted(text)}; did you mean "{name}"?'
        words = re.findall(r"\w+", text)
        if all(len(word) > 1 and word not in FUNCTIONS for word in words):
            known = ", ".join(catalogue())
            return f"unknown surface {_quoted(text)}; the catalogue has {known}; or {_EXPRESSION}"
    if (found := _CALL.match(text)) is not None and found[1].lower() in catalogue():
        name = found[1].lower()
        row = catalogue()[name]
        own = [row.given_as] if row.given_as else [parameter.name for parameter in row.parameters]
        given = ", ".join(f"{key} = ..." for key in own)
        return (
            f"{name} is a name of the catalogue, and stands alone: "
            f'surface = "{name}"{f", with {given} in keys of their own" if given else ""}'
        )
    return None


def nearest_surface(name: str) -> str | None:
    """Return the name of the catalogue that a word is near to, however its parts are joined; None where none is."""
    plain = {_plain(known): known for known in catalogue()}
    close = difflib.get_close_matches(_plain(name)[:40], plain, n=1, cutoff=0.7)
    if close:
        return plain[close[0]]
    words = [word for word in re.split(r"[\W_]+", name.lower()) if word in plain]
    return plain[words[0]] if words else None


def _plain(name: str) -> str:
    return re.sub(r"[\W_]+", "", name.casefold())


def _is_file(text: str) -> bool:
    if len(text) > _LONGEST or "\n" in text:
        return False
    known = _ANY_FILE.fullmatch(text)
    if known is not None and known[1].lower() in _FILES:
        return True
    if _PATH.fullmatch(text):
        return True
    other = _FILE_NAME.fullmatch(text)
    return other is not None and not re.search(rf"\b({'|'.join(_MODULES)})\.\w+\s*$", text)


def _quoted(text: str) -> str:
    """Return a text as TOML spells it, on one line."""
    text = text if len(text) <= _LONGEST_SHOWN else text[: _LONGEST_SHOWN - 3] + "..."
    shown = (c if c.isprintable() and c != "\\" else c.encode("unicode_escape").decode("ascii") for c in text)
    return '"' + "".join(shown).replace('"', '\\"') + '"'


def _or(name: str | None) -> str:
    return f' (did you mean "{name}"?)' if name else ""
