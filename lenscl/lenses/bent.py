"""More solids of optics: hollow lenses, halves of balls, drums, cylinders, toruses, and aspheres of any order."""

from __future__ import annotations

import math
from collections.abc import Callable, Collection, Iterator
from dataclasses import dataclass
from functools import lru_cache
from itertools import pairwise

from lenscl.lenses.forms import BACK, CONICS, FRONT, SPHERE_SAG, conic, named_faces, rim, round_lens, sphere
from lenscl.lenses.rows import length, read, signed, spelled
from lenscl.lenses.singlets import ROUNDING, Face, SingletBox, SingletRules
from lenscl.lenses.solid import Box, Problem, Surface, Values

_ORDER = 20  # highest power of r in an asphere's sag
_SECTORS = 16  # of a quarter of a disc, and as many rings, where a torus's sag is looked at first
_CYLINDRICAL = (*(parameter.name for parameter in CONICS), "thickness", "width", "height")
_SHRINKS = 60  # steps that shrink the neighbourhood of the least place by 2/3 each


def _biconcave(values: Values) -> tuple[Face, Face]:
    return Face(c=-1.0 / values["R1"], keys="R1"), Face(c=1.0 / values["R2"], keys="R2")


def _half_ball_box(values: Values) -> Box:
    r = 0.5 * values["diameter"]
    return (-r, -r, -0.5 * r), (r, r, 0.5 * r)


def _drum_box(values: Values) -> Box:
    r, half = 0.5 * values["diameter"], 0.5 * values["length"]
    return (-r, -r, -half), (r, r, half)


def _drum_rules(values: Values) -> Iterator[Problem]:
    if values["diameter"] > values["length"]:
        yield (
            "diameter",
            f"must be at most the length, which is that of the ball, {values['length']!r}, got {values['diameter']!r}; "
            "lower it, or raise length",
        )


def _cylinders(values: Values) -> tuple[Face, Face]:
    return (
        Face(c=values["c1"], k=values["k1"], keys="c1 and k1"),
        Face(c=values["c2"], k=values["k2"], keys="c2 and k2"),
    )


def _cylinder(c: str, k: str, w: str) -> str:
    return conic(c, k, w, across="y^2")


@dataclass(frozen=True, slots=True)
class Toric:
    """A face of a torus: a circle of curvature `y` in the plane of y and z, turned about a line parallel to y.

    The line lies at 1 / `x` behind the vertex; a curvature may be 0.
    """

    x: float
    y: float
    keys: str = ""

    def sag(self, x: float, y: float) -> float:
        """Return z over the vertex; for places within `reach`."""
        root = math.sqrt(max(1.0 - (self.y * y) ** 2, 0.0))
        s = self.y * y * y / (1.0 + root)
        m = 1.0 - self.x * s
        return s + self.x * x * x / (m + math.sqrt(max(m * m - (self.x * x) ** 2, 0.0)))

    def ends(self, radius: float) -> bool:
        """Say whether the face ends within a disc: beyond either circle, or at the torus's own axis."""
        for i in range(_SECTORS + 1):
            angle = 0.5 * math.pi * i / _SECTORS
            x, y = radius * math.cos(angle), radius * math.sin(angle)
            square = 1.0 - (self.y * y) ** 2
            m = 1.0 - self.x * self.y * y * y / (1.0 + math.sqrt(max(square, 0.0)))
            if square < -ROUNDING or m <= 0.0 or m * m - (self.x * x) ** 2 < -ROUNDING:
                return True
        return False


def _torics(values: Values) -> tuple[Toric, Toric]:
    return (
        Toric(values["c1x"], values["c1y"], "c1x and c1y"),
        Toric(values["c2x"], values["c2y"], "c2x and c2y"),
    )


def _toric_box(values: Values) -> Box:
    front, back = _torics(values)
    r, half = 0.5 * values["diameter"], 0.5 * values["thickness"]
    return (-r, -r, _least_on_disc(front.sag, r) - half), (r, r, half - _least_on_disc(lambda x, y: -back.sag(x, y), r))


def _toric_rules(values: Values) -> Iterator[Problem]:
    front, back = _torics(values)
    thickness, r = values["thickness"], 0.5 * values["diameter"]
    for face in (front, back):
        if face.ends(r):
            yield (
                "diameter",
                f"must be smaller: the face of {face.keys} ends before the rim, got {values['diameter']!r}; "
                "lower it, or bend that face less",
            )
            return
    needed = -_least_on_disc(lambda x, y: back.sag(x, y) - front.sag(x, y), r)
    size = abs(front.sag(r, 0.0)) + abs(front.sag(0.0, r)) + abs(back.sag(r, 0.0)) + abs(back.sag(0.0, r)) + thickness
    if needed > thickness + ROUNDING * size:
        yield (
            "thickness",
            f"must be at least {spelled(needed, up=True)}, or the faces cross before the rim, got {thickness!r}; "
            "raise it, or lower diameter",
        )


def _least_on_disc(of: Callable[[float, float], float], radius: float) -> float:
    """Return the least value on a disc of a smooth function that is even in x and in y."""

    def at(r: float, angle: float) -> float:
        return of(r * math.cos(angle), r * math.sin(angle))

    r_step, a_step = radius / _SECTORS, 0.5 * math.pi / _SECTORS
    places = [(i * r_step, j * a_step) for i in range(_SECTORS + 1) for j in range(_SECTORS + 1)]
    best = min(places, key=lambda place: at(*place))
    for _ in range(_SHRINKS):
        r_step, a_step = r_step * 2.0 / 3.0, a_step * 2.0 / 3.0
        around = [
            (min(max(best[0] + i * r_step, 0.0), radius), best[1] + j * a_step) for i in (-1, 0, 1) for j in (-1, 0, 1)
        ]
        best = min(around, key=lambda place: at(*place))
    return at(*best)


def _toric(cx: str, cy: str, w: str) -> str:
    """Write a torus's face: negative where w, along z from the vertex, exceeds its sag.

    With s, the sag of the circle in y, m = 1 - cx s and u = w - s the torus is cx x^2 + cx u^2 - 2 m u = 0. Its second
    sheet is kept away as that of a conic is, see `optical.conic`.
    """
    s = f"({cy}*y^2/(1 + sqrt(max(1 - ({cy}*y)^2, 0))))"
    m, u = f"(1 - {cx}*{s})", f"({w} - {s})"
    return f"({cx}*x^2 - {u}*max(2*{m} - {cx}*{u}, {m}))"


def _asphere(terms: Collection[str]) -> Surface:
    """Return the asphere with the terms that are named, as A4 or B3; the others are 0, and cost nothing."""
    return _asphere_of(tuple(sorted({*terms} & {parameter.name for parameter in _TERMS}, key=_order)))


def _order(term: str) -> tuple[str, int]:
    return term[0], int(term[1:])


def _sum(letter: str, terms: Collection[str]) -> str:
    """Write a face's terms: Horner's rule in q = r^2, for even and odd powers apart."""
    powers = sorted(int(term[1:]) for term in terms if term[0] == letter)
    parts = []
    for odd in (0, 1):
        own = [power for power in powers if power % 2 == odd]
        text = ""
        for power, below in pairwise([*reversed(own), odd]):
            inner = f"({letter}{power} + {text})" if text else f"{letter}{power}"
            halves = (power - below) // 2
            text = f"{inner}*(x^2 + y^2)^{halves}" if halves else inner
        if text:
            parts.append(f"sqrt(x^2 + y^2)*({text})" if odd else text)
    return " + ".join(parts)


@lru_cache(maxsize=64)
def _asphere_of(terms: tuple[str, ...]) -> Surface:
    sums = {letter: _sum(letter, terms) for letter in "AB"}
    front, back = (f"({w} - ({sums[letter]}))" if sums[letter] else w for letter, w in (("A", FRONT), ("B", BACK)))
    faces = _Aspheres(terms)
    own = tuple(parameter for parameter in _TERMS if parameter.name in terms)
    parameters = (*CONICS, *rim(1.4, 0.5))
    return Surface(
        name="asphere_singlet",
        variant="_".join(terms),
        summary="a conic singlet with terms in r, r^2, ... r^20 added to each face; what is left out costs nothing",
        formula="max(sag(c1, k1, A1 ... A20) - z - thickness/2, z - thickness/2 - sag(c2, k2, B1 ... B20), "
        "hypot(x, y) - diameter/2); sag = c*r^2/(1 + sqrt(1 - (1 + k)*c^2*r^2)) + A1*r + A2*r^2 + ... + A20*r^20",
        source="ISO 10110-12, Aspheric surfaces; here without the root, as a conic in z less the terms",
        parameters=(*parameters, *own),
        **round_lens(
            conic("c1", "k1", front),
            f"-{conic('c2', 'k2', back)}",
            *(parameter.name for parameter in (*parameters, *own)),
        ),
        extent=SingletBox(faces),
        rules=SingletRules(faces),
        optional=_TERMS,
        with_optional=_asphere,
    )


@dataclass(frozen=True, slots=True)
class _Aspheres:
    """The faces of an asphere with some terms."""

    terms: tuple[str, ...]

    def __call__(self, values: Values) -> tuple[Face, Face]:
        front, back = (
            tuple((int(term[1:]), values[term]) for term in self.terms if term[0] == letter) for letter in "AB"
        )
        return (
            Face(c=values["c1"], k=values["k1"], terms=front, keys="c1 and k1"),
            Face(c=values["c2"], k=values["k2"], terms=back, keys="c2 and k2"),
        )


def bent_rows() -> tuple[Surface, ...]:
    """Return the rows, in the catalogue's order."""
    return (
        Surface(
            name="biconcave",
            summary="a lens of two spheres that are both hollow",
            formula="max(-sag(R1) - z - thickness/2, z - thickness/2 - sag(R2), hypot(x, y) - diameter/2); "
            + SPHERE_SAG,
            source="E. Hecht, Optics, sec. 5.2; both radii positive, the thickness that in the middle",
            parameters=(
                length("R1", 1.5, "radius of the front"),
                length("R2", 1.5, "radius of the back"),
                *rim(1.4, 0.2),
            ),
            **round_lens(
                f"-{sphere('R1', '(-z - 0.5*thickness)')}",
                f"-{sphere('R2', BACK)}",
                *("R1", "R2", "thickness", "diameter"),
            ),
            extent=SingletBox(_biconcave),
            rules=SingletRules(_biconcave),
        ),
        Surface(
            name="half_ball",
            summary="half of a ball: it bulges towards -z, and its flat face looks towards +z",
            formula="max(x^2 + y^2 + (z - diameter/4)^2 - diameter^2/4, z - diameter/4)",
            source="elementary",
            parameters=(length("diameter", 1.4, "of the ball"),),
            expression=read(
                "max(x^2 + y^2 + (z - 0.25*diameter)^2 - (0.5*diameter)^2, diameter*(z - 0.25*diameter))", "diameter"
            ),
            faces=named_faces(
                {
                    "front": "x^2 + y^2 + (z - 0.25*diameter)^2 - (0.5*diameter)^2",
                    "back": "diameter*(z - 0.25*diameter)",
                },
                "diameter",
            ),
            extent=_half_ball_box,
            is_convex=True,
        ),
        Surface(
            name="drum",
            summary="a drum lens: a ball ground to a cylinder about z, its ends those of the ball",
            formula="max(x^2 + y^2 + z^2 - length^2/4, hypot(x, y) - diameter/2)",
            source="elementary",
            parameters=(
                length("diameter", 0.9, "of the cylinder"),
                length("length", 1.4, "from vertex to vertex: the diameter of the ball"),
            ),
            expression=read(
                "max(x^2 + y^2 + z^2 - (0.5*length)^2, x^2 + y^2 - (0.5*diameter)^2)", "diameter", "length"
            ),
            faces=named_faces(
                {
                    "front": "min(x^2 + y^2 + z^2 - (0.5*length)^2, -length*z)",
                    "back": "min(x^2 + y^2 + z^2 - (0.5*length)^2, length*z)",
                    "rim": "x^2 + y^2 - (0.5*diameter)^2",
                },
                "diameter",
                "length",
            ),
            extent=_drum_box,
            rules=_drum_rules,
            is_convex=True,
        ),
        Surface(
            name="cylindrical_singlet",
            summary="a rectangular lens of two faces bent along y alone; a curvature of 0 is a plane",
            formula="max(sag(c1, k1) - z - thickness/2, z - thickness/2 - sag(c2, k2), abs(x) - width/2, "
            "abs(y) - height/2); sag(c, k) = c*y^2/(1 + sqrt(1 - (1 + k)*c^2*y^2))",
            source="ISO 10110-12, Aspheric surfaces; k as in conic_singlet",
            parameters=(
                *CONICS,
                length("thickness", 0.5, "from vertex to vertex"),
                length("width", 1.2, "along x, the axis of the cylinders"),
                length("height", 1.2, "along y"),
            ),
            expression=read(
                f"max(max({_cylinder('c1', 'k1', FRONT)}, -{_cylinder('c2', 'k2', BACK)}),"
                " max(2*abs(x) - width, 2*abs(y) - height))",
                *_CYLINDRICAL,
            ),
            faces=named_faces(
                {
                    "front": _cylinder("c1", "k1", FRONT),
                    "back": f"-{_cylinder('c2', 'k2', BACK)}",
                    "+x": "2*x - width",
                    "-x": "-2*x - width",
                    "+y": "2*y - height",
                    "-y": "-2*y - height",
                },
                *_CYLINDRICAL,
            ),
            extent=SingletBox(_cylinders, "height", "width"),
            rules=SingletRules(_cylinders, "height"),
        ),
        Surface(
            name="toroidal_singlet",
            summary="a lens of two toric faces and a round rim: other curvatures along x than along y",
            formula="max(sag(c1x, c1y) - z - thickness/2, z - thickness/2 - sag(c2x, c2y), hypot(x, y) - diameter/2); "
            "sag(p, q) = s + p*x^2/(m + sqrt(m^2 - p^2*x^2)), s = q*y^2/(1 + sqrt(1 - q^2*y^2)), m = 1 - p*s",
            source="ISO 10110-12, toric surfaces: the circle in the plane of y and z, turned about a parallel of y",
            parameters=(
                signed("c1x", 0.8, "curvature of the front along x, positive if its centre is towards +z"),
                signed("c1y", 0.4, "curvature of the front along y"),
                signed("c2x", 0.0, "curvature of the back along x"),
                signed("c2y", -0.3, "curvature of the back along y"),
                *rim(1.4, 0.5),
            ),
            **round_lens(
                _toric("c1x", "c1y", FRONT),
                f"-{_toric('c2x', 'c2y', BACK)}",
                *("c1x", "c1y", "c2x", "c2y", "thickness", "diameter"),
            ),
            extent=_toric_box,
            rules=_toric_rules,
        ),
        _asphere(()),
    )


_TERMS = tuple(
    signed(f"{letter}{power}", 0.0, f"of r^{power} in the {face}'s sag")
    for letter, face in (("A", "front"), ("B", "back"))
    for power in range(1, _ORDER + 1)
)
