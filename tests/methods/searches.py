"""Call one method's search of one surface from Python, with its kernel text as it is or edited."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray
from probe import Probe

from lenscl.codegen import fragment
from lenscl.codegen.fragments import called_by
from lenscl.codegen.searches import ENDINGS, finish_functions
from lenscl.codegen.specialise import parameter_spelling
from lenscl.codegen.surfaces import surface_functions
from lenscl.lenses import Surface
from lenscl.methods import METHODS

Array = NDArray[Any]


@dataclass(frozen=True)
class Roots:
    """What a search says of each ray, arrays of shape (N,)."""

    t: Array
    found: Array
    undecided: Array


class Search:
    """A method's `first_root` of a surface as a function of rays in local space.

    What is edited is built plainly: it only has to be seen to be wrong.
    """

    def __init__(
        self,
        surface: Surface,
        values: Mapping[str, float],
        *,
        method: str = "interval",
        precision: str = "double",
        width: int = 8,
        edit: Callable[[str], str] | None = None,
    ) -> None:
        row = METHODS[method]
        spelling = parameter_spelling(surface)
        shape = "".join(f"  real {spelled};\n" for spelled in spelling.values()) or "  real none;\n"
        # A ray's row ends with the parameters, so that other numbers are no other kernel
        self._parameters = [float(values[name]) for name in spelling]
        inputs = 9 + len(self._parameters)
        sets = "".join(
            f"  shape.{c_name} = in[first * {inputs} + {place}];\n"
            for place, c_name in enumerate(spelling.values(), start=9)
        )
        calls = called_by([surface.expression])
        bands = [f"interval_{name}" for name in calls if row.words]
        before = "\n".join(
            [
                "typedef struct { real none; } method_t;",
                *(fragment(name) for name in ("search.cl", *calls, *row.words, *bands)),
                f"typedef struct {{\n{shape}}} s_t;",
                surface_functions("s", surface, row.writes, precision),  # type: ignore[arg-type]
                finish_functions("s", surface, row, precision),  # type: ignore[arg-type]
                "#define SURFACE(name) s_##name",
                *(fragment(name) for name in row.fragments_for(surface.degree)),
                "#define s_TOLERANCE (realv)0",
                *(fragment(name) for name in ENDINGS[row.ending_for(surface.degree)]),
            ]
        )
        body = f"""
  s_t shape;
{sets}
  method_t method;
  method.none = 0;
  search_t search;
  search.origin.x = in_0; search.origin.y = in_1; search.origin.z = in_2;
  search.direction.x = in_3; search.direction.y = in_4; search.direction.z = in_5;
  search.length = in_6;
  search.inside = in_7 > (realv)0;
  search.departs = in_8 > (realv)0;
  search.lanes = in_6 == in_6;
  const root_t root = s_first_root(search, shape, &method);
  out_0 = root.t;
  out_1 = root.found ? (realv)1 : (realv)0;
  out_2 = root.undecided ? (realv)1 : (realv)0;"""
        text = edit(before) if edit else before
        self._probe = Probe((), body, inputs, 3, precision, width, text, is_plain=edit is not None)

    def __call__(
        self, o: Array, d: Array, length: ArrayLike, inside: ArrayLike = False, departs: ArrayLike = False
    ) -> Roots:
        flags = (np.asarray(flag, float) for flag in (inside, departs))
        out = self._probe(*o.T, *d.T, np.asarray(length, float), *flags, *self._parameters)
        return Roots(out[:, 0], out[:, 1] > 0, out[:, 2] > 0)


def box_rays(box: Any, count: int, seed: int) -> tuple[Array, Array, Array]:
    """Return rays through points of a box: where they enter it, unit directions, and their length in it."""
    rng = np.random.default_rng(seed)
    low, high = (np.asarray(corner, float) for corner in box)
    through = rng.uniform(low, high, (count, 3))
    d = rng.normal(size=(count, 3))
    d /= np.linalg.norm(d, axis=1, keepdims=True)
    with np.errstate(divide="ignore"):
        sides = np.stack([(low - through) / d, (high - through) / d])
    enter, leave = sides.min(0).max(1), sides.max(0).min(1)
    return through + enter[:, None] * d, d, leave - enter
