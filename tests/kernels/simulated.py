"""Run kernels on oclgrind, a simulator that sees every access beyond a buffer; a process of its own.

    python tests/kernels/simulated.py all|some

What oclgrind finds goes to the standard error, behind a line `== NAME` for each of the kernels; families first, then
the searches alone, painting, and kernels broken on purpose.
"""

from __future__ import annotations

import sys
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace
from typing import Any

import numpy as np
from kernels.families import Family, all_pairs, each_once, ends_of
from methods.searches import Search, box_rays
from probe import FORMS, of_width
from scenes import make_scene

import lenscl
from lenscl import device
from lenscl.codegen import assemble, fragments
from lenscl.device import Device
from lenscl.imaging.encoding import DTYPES
from lenscl.lenses import surface
from lenscl.methods import METHODS
from lenscl.tracing.job import Job
from lenscl.tracing.parking import Parking

# A fragment, what it says, what it says in the twin that reaches one element too far, and a family that has it. One ray
# to a packet: where there are more, a step of one element is seen already because it breaks their alignment
BROKEN = {
    "status one on": ("ends_map.cl", "status + first", "status + first + 1", {"ends": "map", "width": 1}),
    "events one on": ("ends_legs.cl", "events + first", "events + first + 1", {"ends": "legs", "width": 1}),
    "places one on": ("ends_map.cl", "st + 2 * first", "st + 2 * first + 1", {"ends": "map", "width": 1}),
    "directions one on": ("ends_legs.cl", "direction + 3 * first + 2", "direction + 3 * first + 3", {"ends": "legs"}),
    "lens read one on": ("rays_given.cl", "(on + first)", "(on + first + 1)", {"rays": "given", "width": 1}),
    "origin read one on": ("rays_given.cl", "gather(o + 2, 3)", "gather(o + 3, 3)", {"rays": "given", "width": 1}),
    "one lane too many": ("memory.cl", "i < VW; ++i) out", "i <= VW; ++i) out", {"ends": "legs", "width": 1}),
    "counts one on": ("steps_counted.cl", "(0) + 1]", "(0) + 2]", {"counts": "counted", "width": 1}),
    "parked one on": ("parks.cl", "(parked + layer.number, few)", "(parked + 1, few)", {"width": 4, "rays": "point"}),
}


class _Exact:
    """Memory in pieces of just the size asked for: the program's own pool gives more, and hides a step too far."""

    def __init__(self, allocator: Any) -> None:
        self.allocate = allocator


def simulator() -> Device:
    """Return oclgrind as a CPU, so that work-items carry several packets, and rays are put aside."""
    here = replace(device.choose("oclgrind"), kind="cpu")
    assert "oclgrind" in here.label.lower()
    sys.modules["pyopencl.tools"].MemoryPool = _Exact  # type: ignore[attr-defined]  # which every session takes
    assert isinstance(here._session.memory, _Exact)
    return here


@contextmanager
def broken(file: str, right: str, wrong: str) -> Iterator[None]:
    """Change a fragment for a while."""
    real = fragments.fragment

    def changed(name: str) -> str:
        text = real(name)
        if name == file:
            assert right in text
            text = text.replace(right, wrong)
        return text

    fragments.fragment = changed  # type: ignore[assignment]
    assemble._kept.clear()
    try:
        yield
    finally:
        fragments.fragment = real
        assemble._kept.clear()


def say(name: object) -> None:
    print(f"== {name}", file=sys.stderr, flush=True)


def run_family(family: Family, here: Device) -> None:
    ends = ends_of(family, here)
    assert len(ends["status"]) == 35
    assert (ends["events"] > 0).any()


def run_searches(here: Device, some: bool) -> None:
    """Search rays by each method alone, as other tests do."""
    device.choose = lambda wanted=None: here  # type: ignore[assignment]
    names = [name for name, row in METHODS.items() if not (row.reads or row.wants_planes or row.wants_leaves)]
    torus, values = surface("torus"), {"R": 0.7, "r": 0.25}
    rays = box_rays(torus.box(values), 5, seed=1)
    for number, name in enumerate(names):
        for precision, width in FORMS[number :: len(names)] if some else FORMS:
            say(f"search: {name} {precision} {width}")
            roots = Search(torus, values, method=name, precision=precision, width=width)(*rays)
            assert len(roots.t) == 5


def run_wavelengths(here: Device) -> None:
    """Trace wavelengths, of each of which rays are put aside and carried on."""
    lens = {"surface": "ellipsoid", "a": 1.0, "b": 0.8, "c": 0.6, "n": "SF11"}
    scene = make_scene(lens, film={"size": [7, 31]}, effects={"dispersion": 3})
    job = Job.prepare(scene, "point", "map", None, "single", of_width(here, 4, 4))
    aside: list[int] = []
    places = Parking.places
    Parking.places = lambda self: (found := places(self), aside.extend(map(len, found)))[0]  # type: ignore[method-assign]
    say("trace: wavelengths")
    job.run_film()
    Parking.places = places  # type: ignore[method-assign]
    assert min(aside) > 0
    assert len(aside) == 3


def run_painting(here: Device, some: bool) -> None:
    """Paint pictures of every type by every filter, and by footprints that reach into their levels."""
    for number, precision in enumerate(("single", "double")):
        film = {"size": [3, 5]}
        raymap = lenscl.trace(make_scene({"surface": "torus"}, film=film), precision=precision, device=here)
        for dtype in DTYPES[number::2] if some else DTYPES:
            for channels, name in ((1, "nearest"), (2, "bilinear"), (3, "bicubic"), (4, "bilinear"), (4, "bicubic")):
                say(f"paint: {precision} {dtype} {channels} {name}")
                picture = np.ones((2, 3, channels), dtype)
                assert lenscl.paint(raymap, picture, filter=name, outside=1).shape == (5, 3, channels)
        wide = make_scene({"surface": "torus"}, film=film, effects={"footprint": True})
        say(f"trace: footprints, {precision}")
        raymap = lenscl.trace(wide, precision=precision, device=here)
        for dtype in DTYPES[number::2] if some else DTYPES:
            say(f"paint: {precision} {dtype} by footprints")
            assert lenscl.paint(raymap, np.ones((47, 33, 3), dtype), outside=1).shape == (5, 3, 3)


def main(some: bool) -> None:
    here, families = simulator(), all_pairs()
    for family in each_once(families) if some else families:
        say(family)
        run_family(family, here)
    for name, (file, right, wrong, fits) in BROKEN.items():
        family = next(each for each in families if all(getattr(each, key) == value for key, value in fits.items()))
        with broken(file, right, wrong):
            say(f"broken: {name}")
            run_family(family, here)
    for source in (None, {"kind": "parallel", "direction": [0.0, 0.0, -1.0]}):
        scene = make_scene({"surface": "heart"}, film={"size": [5, 3]}, source=source)
        say(f"trace: {scene.source}")
        raymap = lenscl.trace(scene, precision="single", device=of_width(here, 4, 4))
        assert raymap.origin.shape == (3, 5, 3)
    run_wavelengths(here)
    run_painting(here, some)
    run_searches(here, some)
    say("done")


if __name__ == "__main__":
    main(sys.argv[1] == "some")
