"""Generated kernels as they are written down in tests/golden: what changes in them can be read.

A golden file has the generated parts of a kernel in full, and of each fragment its name. `pytest --write-golden` writes
them anew.
"""

from __future__ import annotations

import re
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
from scenes import make_scene

from lenscl.codegen import kernel_source
from lenscl.config import Scene
from lenscl.device import choose
from lenscl.effects import EFFECTS
from lenscl.tracing import kernel_source as source_of

pytestmark = pytest.mark.users_kernels

GOLDEN = Path(__file__).parent.parent / "golden"
BOUNDS = [[-1.2] * 3, [1.2] * 3]
BEHIND: dict[str, Any] = {"corner": [-3.0, 3.0, -3.5]}  # a picture that no lens reaches
ALL: dict[str, Any] = {"total_reflection": "end", "absorption": True, "fresnel": True, "path_length": True}
SCENES: dict[str, tuple[Scene, str | None]] = {
    "nothing-asked-for": (make_scene({"surface": "sphere"}), None),
    "torus": (make_scene({"surface": "torus"}), None),
    "torus-single": (make_scene({"surface": "torus"}, numerics={"precision": "single"}), None),
    "heart-mixed": (make_scene({"surface": "heart"}, numerics={"precision": "mixed"}), None),
    "expression-march": (
        make_scene({"surface": "max(abs(x) + abs(z) - 0.8, 0.2*sin(k*y) + y*y - 0.5)", "k": 2.0, "bounds": BOUNDS},
                   numerics={"method": "march"}),
        None,
    ),
    "two-lenses-given": (
        make_scene({"surface": "torus", "name": "a"}, {"surface": "ball", "name": "b", "centre": [0, 0, -2]},
                   picture=BEHIND),
        "given",
    ),
    "every-effect": (
        make_scene({"surface": "torus", "name": "a"}, {"surface": "ball", "name": "b", "centre": [0, 0, -2]},
                   picture=BEHIND, effects=ALL, source={"kind": "parallel", "direction": [0, 0, -1]}),
        None,
    ),
    "footprint": (
        make_scene({"surface": "torus", "name": "a"}, {"surface": "ball", "name": "b", "centre": [0, 0, -2]},
                   picture=BEHIND, effects={"footprint": True}),
        None,
    ),
    "wavelengths": (make_scene({"surface": "prism", "n": "BK7"}, effects={"dispersion": 3}), None),
    "polarised": (make_scene({"surface": "biconvex"}, effects={"fresnel": "polarised"}), None),
    "split": (make_scene({"surface": "heart"}, effects={"fresnel": "split", "environment": "picture"}), None),
}  # fmt: skip


def condensed(scene: Scene, rays: str | None) -> str:
    """Return a kernel's generated parts, and the names of its fragments, as no machine's packets change them."""
    structure = replace(source_of(scene, rays=rays).structure, width=8, run=1, parks=False)
    text = kernel_source(structure).text
    parts = re.split(r'^(#line 1 "[^"]+"\n)', text, flags=re.M)
    lines = [parts[0]]
    for mark, part in zip(parts[1::2], parts[2::2], strict=True):
        name = mark.split('"')[1]
        lines.append(mark + part if name == "generated" else f"// ... {name}\n")
    return "".join(lines)


@pytest.mark.parametrize("name", SCENES)
def test_kernels_are_written_as_they_were(name: str, request: pytest.FixtureRequest) -> None:
    path = GOLDEN / f"{name}.cl"
    text = condensed(*SCENES[name])
    if request.config.getoption("--write-golden"):
        path.write_text(text, encoding="utf-8")
    assert text == path.read_text(encoding="utf-8"), f"{path.name} differs; if it should, pytest --write-golden"


def test_every_golden_file_has_its_scene() -> None:
    assert {path.stem for path in GOLDEN.glob("*.cl")} == set(SCENES)


def test_who_asks_for_nothing_gets_nothing() -> None:
    """No word of any effect: no fragment, member, argument, buffer or call."""
    text = (GOLDEN / "nothing-asked-for.cl").read_text(encoding="utf-8")
    assert "// effects  none\n" in text
    words = {"transmittance", "transmission", "absorption", "path_length", "polarised", "opaque", "effects/"}
    words |= {one.name for effect in EFFECTS.values() for some in effect.variants.values() for one in some}
    words |= {"wavelength", "wavelengths", "mirrored"}
    words |= {member for effect in EFFECTS.values() for some in effect.variants.values() for one in some
              for member in one.carries}  # fmt: skip
    found = {word for word in words if re.search(rf"\b{word}\b", text)}
    assert found == set()
    assert "#define RAY_CARRIES\n" in text
    assert "#define EFFECT_PARAMETERS\n" in text
    every = (GOLDEN / "every-effect.cl").read_text(encoding="utf-8")
    assert {"transmittance", "path_length", "red", "end_at_total_reflection", "opaque"} <= set(
        re.findall(r"\w+", every)
    )


def test_golden_kernels_compile() -> None:
    for scene, rays in (SCENES[name] for name in ("every-effect", "footprint", "polarised", "split", "wavelengths")):
        choose().build(source_of(scene, rays=rays).text, kind="probe")
