"""The faces of a solid by name, and which of them a mirror covers.

A face is a function that is negative on its inner side; the solid is where all of them are negative. A point of the
surface lies on the face whose function is the largest there. So a solid that is coated on some faces is told by two
functions, the largest of the coated faces' and the largest of the others'.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from functools import lru_cache

from lenscl.expr import Expr, Facts, evaluate, sign_form
from lenscl.expr.creases import creased
from lenscl.expr.graph import build
from lenscl.expr.planar import MOST_PLANES
from lenscl.lenses.solid import Surface, Values

_WHOLE = "surface"  # the face of a catalogue surface that has one alone


def largest(parts: Collection[Expr]) -> Expr:
    """Return the max of some expressions, as a tree that is as shallow as it can be."""
    listed = list(parts)
    if len(listed) == 1:
        return listed[0]
    half = (len(listed) + 1) // 2
    return build("max", largest(listed[:half]), largest(listed[half:]))


def face_names(surface: Surface) -> tuple[str, ...]:
    """Return the names of a surface's faces.

    Those of a polyhedron are the numbers of its planes, and those of an expression the numbers of the operands of its
    outermost `max`, from 1. A surface of the catalogue that is one smooth face has "surface".
    """
    return tuple(face_functions(surface))


@lru_cache(maxsize=256)
def face_functions(surface: Surface) -> Mapping[str, Expr]:
    """Return the faces of a surface, by name; see this module."""
    if surface.faces:
        return dict(surface.faces)
    if surface.promised is not None:
        facts = Facts(surface.promised)
        return {str(i): sign_form(part, facts) for i, part in enumerate(_operands(surface.as_written), 1)}
    if surface.planes:
        leaves = creased(surface.expression, MOST_PLANES)[1].values()
        names = surface.plane_names or tuple(map(str, range(1, len(leaves) + 1)))
        groups: dict[str, list[Expr]] = {}
        for name, leaf in zip(names, leaves, strict=True):
            groups.setdefault(name, []).append(leaf)
        return {name: largest(group) for name, group in groups.items()}
    return {_WHOLE: surface.expression}


def written_faces(surface: Surface) -> Mapping[str, Expr]:
    """Return the same of an expression as it was written, without any form of the same sign."""
    if surface.promised is None or surface.faces:
        return face_functions(surface)
    return {str(i): part for i, part in enumerate(_operands(surface.as_written), 1)}


def _operands(expr: Expr) -> tuple[Expr, ...]:
    """Return the operands of the outermost `max`, those of one in it among them."""
    if expr.op != "max":
        return (expr,)
    return tuple(part for arg in expr.args for part in _operands(arg))


def is_whole(surface: Surface, coated: Collection[str]) -> bool:
    """Return whether some faces, by name, are all that a surface has."""
    return set(face_names(surface)) <= set(coated)


def coat_functions(surface: Surface, coated: Collection[str], *, as_written: bool = False) -> tuple[Expr, Expr]:
    """Return the largest of the coated faces' functions, and the largest of the others'."""
    faces = written_faces(surface) if as_written else face_functions(surface)
    return (
        largest([face for name, face in faces.items() if name in coated]),
        largest([face for name, face in faces.items() if name not in coated]),
    )


def face_at(surface: Surface, values: Values, local: Sequence[float]) -> str:
    """Return the name of the face that a point of the surface lies on, in local coordinates."""
    at = {**values, **dict(zip("xyz", local, strict=True))}
    faces = {name: float(evaluate(face, at)) for name, face in face_functions(surface).items()}
    return max(faces, key=faces.__getitem__)


def coated_planes(surface: Surface, coated: Collection[str]) -> tuple[bool, ...] | None:
    """Return of each plane of a polyhedron whether it is coated; None where the planes are not those of the faces."""
    leaves = list(creased(surface.expression, MOST_PLANES)[1].values())
    owner: dict[Expr, str] = {}
    for name, face in face_functions(surface).items():
        for leaf in creased(face, MOST_PLANES)[1].values():
            owner.setdefault(leaf, name)
    if not all(leaf in owner for leaf in leaves):
        return None
    return tuple(owner[leaf] in coated for leaf in leaves)
