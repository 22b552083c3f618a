"""Kernels broken on purpose: what tests of the physics, and packs of hard cases, must notice.

A fault is a piece of text in one kernel fragment, and what stands in its place. Some are the faults of programs that
came before this one; all of them compile, and most of them leave many rays as they are.
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass

import pytest

from lenscl.codegen import Structure, assemble, fragments


@dataclass(frozen=True, slots=True)
class Fault:
    """What is wrong, the fragment's file below kernels/, and the text that is found there and replaced."""

    name: str
    file: str
    old: str
    new: str


FAULTS = (
    Fault("sign under the root of Snell's law", "snell_exact.cl", "c * c + excess *", "c * c - excess *"),
    Fault("total reflection missed", "total_possible.cl", "*total = square < (realv)0;", "*total = (maskv)0;"),
    Fault("total reflection too early", "snell_exact.cl", "across), total);",
          "across) - (realv)NUMBER(0.3) * dot3(g, g), total);"),
    Fault("index ratio inverted on exit", "lens.cl", "(realv)lens->eta_out", "(realv)lens->eta_in"),
    Fault("normal not turned against the ray", "trace.cl", "turns = leaves ? (realv)-1 : (realv)1;",
          "turns = (realv)1;"),
    Fault("normal without the inverse transpose", "lens.cl", "real3v n = to_world_normal(lens, gradient);",
          "real3v n = turn3(lens->to_world, gradient);"),
    Fault("reflected not quite", "effects/mirrored.cl", "(realv)-2 *", "(realv)NUMBER(-1.999) *"),
    Fault("direction not unit", "rays_point.cl", "aims ? (realv)1 / sqrt(square)", "aims ? (realv)1"),
    Fault("refracted longer than unit", "snell_exact.cl", "eta * d.z - along * g.z}",
          "(realv)NUMBER(1.001) * (eta * d.z - along * g.z)}"),
    Fault("last roots dropped", "polynomial_ray.cl", "  root.t = max_v(root.t, (realv)0) * search->length;",
          "  root.found = root.found & (root.t < (realv)NUMBER(0.75));\n"
          "  root.t = max_v(root.t, (realv)0) * search->length;"),
    Fault("first root passed over", "ahead_chord.cl", "-(b + reach) * inverse;", "(reach - b) * inverse;"),
    Fault("box left behind", "ahead_box.cl", "search->length = span.leave - *from;",
          "search->length = (realv)4 * (span.leave - *from);"),
    Fault("known root met again", "polynomial_ray.cl", "side * (search->departs ? c[i + 1] : c[i]);", "side * c[i];"),
    Fault("re-entry lost", "trace.cl", "*travels & hit.found & not",
          "*travels & hit.found & (ray->events < (maskv)2) & not"),
    Fault("side taken from the sign of F", "polynomial_ray.cl", "search->inside ? (realv)-1 : (realv)1;",
          "c[0] < (realv)0 ? (realv)-1 : (realv)1;"),
    Fault("farther lens met first", "lens.cl", "(t < hit->t)", "(t > hit->t)"),
    Fault("point beside the surface", "lens.cl", "at3(search.origin, search.direction, root.t)",
          "at3(search.origin, search.direction, root.t * (realv)NUMBER(1.001))"),
    Fault("picture closed at 1", "screen.cl", "(s < (realv)1)", "(s <= (realv)1)"),
    Fault("s and t swapped", "screen.cl", "place.s = arrives ? s : (realv)-1;\n  place.t = arrives ? t :",
          "place.s = arrives ? t : (realv)-1;\n  place.t = arrives ? s :"),
    Fault("screen behind the ray accepted", "screen.cl", "meets = (distance > (realv)0) &", "meets ="),
    Fault("half a pixel off", "film.cl", "half_pixel = NUMBER(0.5);", "half_pixel = NUMBER(0.0);"),
    Fault("rows and columns of the film mixed up", "film.cl", "  row += (real)tile.x + half_pixel;",
          "  const realv other = row;\n  row = column;\n  column = other;\n  row += (real)tile.x + half_pixel;"),
    Fault("event limit off by one", "trace.cl", ">= (maskv)max_events", "> (maskv)max_events"),
    Fault("event limit without its status", "trace.cl", "trapped, RAY_TRAPPED)", "trapped, RAY_UNDECIDED)"),
    Fault("one doubt ends its whole packet", "trace.cl", "  end_ray(ray, undecided, RAY_UNDECIDED);",
          "  end_ray(ray, any_lane(undecided) ? *travels : undecided, RAY_UNDECIDED);"),
)  # fmt: skip


@contextmanager
def broken(fault: Fault) -> Iterator[None]:
    """Assemble kernels with a fault in them; those that were assembled before are whole."""
    real = fragments.fragment

    def patched(file: str) -> str:
        text = real(file)
        if file == fault.file:
            assert text.count(fault.old) == 1, f"{fault.name}: {fault.file} has changed"
            text = text.replace(fault.old, fault.new)
        return text

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(fragments, "fragment", patched)
        patch.setattr(assemble, "_kept", {})  # what was written of the whole ones
        yield


_media = assemble._media


@contextmanager
def swapped_priorities() -> Iterator[None]:
    """Assemble kernels in which the lens of lowest priority is the medium where some overlap."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(assemble, "_media", _lowest_first)
        patch.setattr(assemble, "_kept", {})
        yield


def _lowest_first(structure: Structure) -> Iterator[str]:
    order = [number for number in structure.nests if number in structure.lenses]
    text = "".join(_media(structure))
    for number, other in zip(order, reversed(order), strict=True):
        bits = [structure.nests.index(each) for each in (number, other)]
        own, swapped = (
            f"(maskv)(MASK){1 << bits[k]}) != (maskv)0 ? (maskv){each}" for k, each in enumerate((number, other))
        )
        assert own in text
        text = text.replace(own, f"@{swapped}")
    yield text.replace("@", "")
