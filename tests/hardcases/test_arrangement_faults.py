"""Kernels that break media, contact or the picture's stop: the pack finds each, in the families of that kind alone."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import ExitStack, contextmanager

import pytest
from faults_in_kernels import Fault, broken, swapped_priorities
from probe import plain_device

from lenscl.hardcases import Verdict, load_pack, run_pack

ARRANGEMENTS, PICTURES = "arrangements", "pictures in glass"
OTHERS = ("null lens: torus", "screens: a film of 3 x 7", "opaque: a film before a torus of 1.5")
DOUBLET = "arrangements: doublet of a prescription"
BUBBLE = "arrangements: bubble"
OVERLAP = "arrangements: overlap, 1"
DOME = "pictures in glass: half ball, on its flat face"
BETWEEN = "pictures in glass: where two blocks touch"
STAIN = "pictures in glass: a stain in resin, z = 0.05"
GIVES_WAY = "pictures in glass: a stain in resin that gives way, z = 0.05"
EDGE = "pictures in glass: beside the picture's edge"
RING = "pictures in glass: cutting a solid, ring, tilted"

_LENS, _TRACE, _STOP = "lens_nested.cl", "trace_nested.cl", "picture_stops.cl"
_ABSORB, _PATH = "effects/absorption_nested.cl", "effects/path_length_nested.cl"
_GAP = Fault("contact as a gap", _LENS, "    unknown = beside & not_lane(contact | certain);",
             "    before = before | (contact & (apart < (realv)0));\n    contact = (maskv)0;")  # fmt: skip
_BENDS = Fault("bends within one medium", _TRACE, "passes = meets & (before == after);", "passes = (maskv)0;")
_LOST = Fault("left out of the set", _TRACE, "ray->inside ^ hit.crossed;", "ray->inside | hit.crossed;")
_BEHIND = (
    Fault("picture behind the face that it lies on", _STOP, "(place.distance - blur > hit->high);",
          "(place.distance + blur > hit->low);"),
    Fault("and not seen from the face", _STOP, "(place.distance > -blur);", "(place.distance > blur);"),
    Fault("and landed on from behind it", "screen_nested.cl",
          "end_ray(ray, on_plane & not_lane(beside), RAY_UNDECIDED);", ""),
)  # fmt: skip
_LATE = Fault("surfaces before the picture", _STOP, "behind = hit->found & (place.distance - blur > hit->high);",
              "behind = hit->found;")  # fmt: skip
_EARLY = Fault("the picture before surfaces", _STOP, "behind = hit->found & (place.distance - blur > hit->high);",
               "behind = (maskv)0;\n  hit->high = place.distance;\n  hit->low = (realv)REAL_MAX;")  # fmt: skip
_WIDE = Fault("the picture's whole plane stops", _STOP, "is_on = (s < edge - s_blur) & (t < edge - t_blur) & is_ahead;",
              "is_on = is_ahead;")  # fmt: skip
_AFTER = Fault("absorption of the medium entered", _ABSORB, "lens_absorption(scene, at->before, 0)",
               "lens_absorption(scene, at->after, 0)")  # fmt: skip
_SURFACE = Fault("absorption of the lens whose surface it is", _ABSORB, "lens_absorption(scene, at->before, 1)",
                 "lens_absorption(scene, at->lens, 1)")  # fmt: skip
_LAST = Fault("nothing absorbed on the last leg", _ABSORB, "(medium != NOWHERE) & place->meets", "(maskv)0")
_AROUND = Fault("the last leg's path in the medium around", _PATH, "index_of(scene, medium_of(ray->inside)) *",
                "(realv)scene->n_medium *")  # fmt: skip

# Fault; the cases that find it, and what the report says of one of their rays
FAULTS: dict[str, tuple[Fault | tuple[Fault, ...] | None, tuple[str, ...], str]] = {
    "priority swapped": (None, (BUBBLE, OVERLAP, GIVES_WAY), "it must"),
    "contact as a gap": (_GAP, (DOUBLET,), "after 4 events; it must end BEHIND after 3 events"),
    "bends within one medium": (_BENDS, (OVERLAP, GIVES_WAY), "it must end"),
    "left out of the set": (_LOST, (BUBBLE,), "is undecided without need"),
    "picture behind the face that it lies on": (_BEHIND, (DOME,), "after 2 events; it must end PICTURE after 1 events"),
    "surfaces before the picture": (_LATE, (DOME, BETWEEN, RING, STAIN), "it must end PICTURE"),
    "the picture before surfaces": (_EARLY, (RING,), "ends PICTURE after"),
    "the picture's whole plane stops": (_WIDE, (EDGE,), "after 1 events; it must end"),
    "absorption of the medium entered": (_AFTER, (STAIN,), "transmission of red light is"),
    "absorption of the lens whose surface it is": (_SURFACE, (STAIN,), "transmission of green light is"),
    "nothing absorbed on the last leg": (_LAST, (STAIN, GIVES_WAY), "transmission of red light is"),
    "the last leg's path in the medium around": (_AROUND, (STAIN, GIVES_WAY), "path length is"),
}  # fmt: skip
EVERY = tuple(dict.fromkeys([*(name for _, names, _ in FAULTS.values() for name in names), *OTHERS]))


@contextmanager
def planted(faults: Fault | tuple[Fault, ...] | None) -> Iterator[None]:
    with ExitStack() as stack:
        if faults is None:
            stack.enter_context(swapped_priorities())
        for fault in (faults,) if isinstance(faults, Fault) else faults or ():
            stack.enter_context(broken(fault))
        yield


def verdicts(names: tuple[str, ...]) -> dict[str, Verdict]:
    pack = load_pack().having(names)
    found = run_pack(pack, method="auto", precision="double", device=plain_device(1))
    return {each.case.name: each for each in found if each.case.name in names}


def test_whole_kernels_are_right_in_all_of_these_cases() -> None:
    found = verdicts(EVERY)
    assert found.keys() == set(EVERY)
    assert [str(wrong) for each in found.values() for wrong in each.wrong] == []


@pytest.mark.parametrize("name", FAULTS)
def test_the_pack_finds_the_fault_and_says_where(name: str) -> None:
    fault, cases, says = FAULTS[name]
    with planted(fault):
        found = verdicts((*cases, *OTHERS))
    assert {each.case.name for each in found.values() if each.wrong} == set(cases)
    told = [str(wrong) for each in found.values() for wrong in each.wrong]
    assert len(told) >= len(cases)
    assert any(says in each for each in told), told[:5]
