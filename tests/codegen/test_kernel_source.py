"""The generated kernel: what is in it, what is not, and that it compiles in every form."""

from __future__ import annotations

from dataclasses import replace
from itertools import product
from pathlib import Path

import numpy as np
import pytest
from probe import FORMS, plain_device
from scenes import CATALOGUE, make_scene

from lenscl import compile_count, trace
from lenscl.codegen import assemble, fragment, kernel_source
from lenscl.device import choose
from lenscl.effects import EFFECTS
from lenscl.tracing import kernel_source as source_of
from lenscl.tracing import trace_rays

KERNELS = Path(__file__).parent.parent.parent / "kernels"
MIXED = ({"surface": "torus", "name": "ring"}, {"surface": "sphere", "name": "ball", "r": 0.2, "centre": [0, 0, 1.5]})


def test_equal_structures_give_equal_text_whatever_the_numbers() -> None:
    one = make_scene({"surface": "torus"})
    other = one.replace(
        {"lens.r": 0.1, "lens.n": 1.7, "lens.centre": [1, 2, 3], "film.size": [5, 9], "numerics.step": 0.2}
    )
    assert source_of(one).text == source_of(other).text
    assert source_of(one).key == source_of(other).key
    assert source_of(one).text != source_of(make_scene({"surface": "heart"})).text


@pytest.mark.parametrize(
    "change",
    [
        {"lens.surface": "sphere"},
        {"numerics.method": "interval"},
        {"numerics.method": "march"},
        {"numerics.precision": "single"},
        {"numerics.precision": "mixed"},
        {"numerics.snell": "paraxial"},
        {"effects.total_reflection": "end"},
        {"source.kind": "parallel", "source.direction": [0, 0, -1]},
    ],
)
def test_what_was_written_is_kept_and_never_taken_for_another(change: dict[str, object]) -> None:
    """Text that is kept equals text written anew, for a structure and for one that differs in a single respect."""
    for scene in (make_scene({"surface": "torus"}), make_scene({"surface": "torus"}).replace(change)):
        for rays in (None, "given"):
            structure = source_of(scene, rays=rays).structure
            for one in (structure, replace(structure, counts=True), replace(structure, parks=not structure.parks),
                        replace(structure, width=4), replace(structure, run=structure.run + 1)):  # fmt: skip
                kernel_source(one)
                assert kernel_source(one).text == assemble._written(one)[1]
                assert kernel_source(one).structure is one


def test_no_number_of_the_scene_is_baked_in() -> None:
    text = source_of(make_scene({"surface": "torus", "r": 0.123456, "n": 1.654321, "centre": [0.77777, 0, 0]})).text
    assert not any(digits in text for digits in ("123456", "654321", "77777"))


@pytest.mark.parametrize("value", ["follow", "end"])
def test_an_effect_that_is_not_asked_for_leaves_no_text(value: str) -> None:
    text = source_of(make_scene({"surface": "torus"}, effects={"total_reflection": value})).text
    for name, (variant,) in EFFECTS["total_reflection"].variants.items():
        assert (variant.name in text) == (name == value)
    bare = kernel_source(replace(source_of(make_scene({"surface": "torus"})).structure, effects=())).text
    every = [variant for effect in EFFECTS.values() for some in effect.variants.values() for variant in some]
    assert len(every) >= 7
    assert all(f"{variant.name}_{hook}" not in bare for variant in every for hook in variant.hooks)
    choose().build(bare, kind="probe")


def test_a_surface_used_twice_is_written_once() -> None:
    text = source_of(
        make_scene({"surface": "torus", "name": "a"}, {"surface": "torus", "name": "b", "centre": [0, 0, 1]})
    ).text
    assert text.count("static inline void torus_along(") == 1
    assert "lens_1_meet(ray" in text
    assert "shape_1" in text


def test_expressions_of_different_structure_get_names_of_their_own() -> None:
    bounds = [[-1.5] * 3, [1.5] * 3]
    scene = make_scene(
        {"surface": "x**2 + y**2 + z**2 - size", "size": 0.5, "bounds": bounds, "name": "a"},
        {
            "surface": "x**4 + y**4 + z**4 - shape",
            "shape": 0.1,
            "bounds": bounds,
            "name": "b",
            "centre": [0.0, 0.0, -1.9],
        },
    )
    text = source_of(scene).text
    assert "expression_2_t" in text
    assert (trace(scene).events >= 4).any()  # names of the kernels' own are fine as names of parameters


POINT = {"kind": "point", "at": [0.0, 0.0, 4.0]}
PARALLEL = {"kind": "parallel", "direction": [0.0, 0.0, -1.0]}
EACH_TWO = [  # kinds of rays, of Snell's rule and of the effect, any two of them together once
    *((POINT, "exact", "follow"), (POINT, "paraxial", "end")),
    *((PARALLEL, "exact", "end"), (PARALLEL, "paraxial", "follow")),
]
EACH_ONE = [(POINT, "exact", "follow"), (PARALLEL, "paraxial", "end")]


@pytest.mark.parametrize(("precision", "width"), FORMS)
def test_every_form_of_the_kernel_compiles_and_traces_alike(
    precision: str, width: int, request: pytest.FixtureRequest
) -> None:
    """Kinds of rays, Snell's rule and effects: every two for one lane of double and 4 of single, else each once."""
    is_whole = request.config.getoption("--slow")
    device, narrow = plain_device(width, width), plain_device(1, 1)
    traced = 0
    forms = EACH_TWO if (precision, width) in (("double", 1), ("single", 4)) else EACH_ONE
    if is_whole:
        forms = list(product((POINT, PARALLEL), ("exact", "paraxial"), ("follow", "end")))
    for source, snell, total in forms:
        scene = make_scene(
            *MIXED,
            source=source,
            film={"size": [13, 5]},
            numerics={"snell": snell, "precision": precision},
            effects={"total_reflection": total},
        )
        here, best = trace(scene, device=device), trace(scene, precision="double", device=narrow)
        assert here.kernel.structure.width == width
        assert (here.events != best.events).mean() < 0.05
        traced += int((here.events > 0).sum())
    assert traced > 30
    if not (is_whole or (precision, width) in (("single", 1), ("double", 16))):
        return
    origin = np.tile([0.0, 0.0, 4.0], (7, 1))
    aim = np.stack([np.linspace(-0.25, 0.25, 7), np.zeros(7), -np.ones(7)], 1)
    assert (trace_rays(make_scene(*MIXED), origin, aim, precision=precision, device=device).events > 0).any()


@pytest.mark.parametrize("surface", CATALOGUE)
def test_every_surface_compiles_in_both_precisions_without_a_warning(surface: str) -> None:
    for precision in ("single", "double"):
        raymap = trace(make_scene({"surface": surface}, film={"size": [24, 24]}), precision=precision)
        assert (raymap.events > 0).any()


def test_two_hundred_points_over_numbers_build_one_program() -> None:
    scene = make_scene({"surface": "torus", "R": 0.61}, film={"size": [4, 4]}, numerics={"max_events": 9})
    trace(scene)
    before, traced = compile_count(), 0
    for r in np.linspace(0.05, 0.5, 20):
        for n in np.linspace(1.1, 2.0, 10):
            trace(scene.replace({"lens.r": float(r), "lens.n": float(n)}))
            traced += 1
    assert traced == 200
    assert compile_count() == before
    bounds = [[-1.0] * 3, [1.0] * 3]
    trace(make_scene({"surface": "x**2 + y**2 + z**2 - 0.37 - x * y * z", "bounds": bounds}, film={"size": [4, 4]}))
    assert compile_count() == before + 1  # another form is another program


def test_generated_text_opens_with_what_it_is_and_marks_its_files() -> None:
    text = source_of(make_scene({"surface": "torus"})).text
    assert text.startswith("// lenses   torus\n")
    for name in ("prelude.cl", "search_polynomial.cl", "lens.cl", "trace.cl"):
        assert f'#line 1 "{name}"' in text


def test_fragments_stay_small_and_say_what_they_provide() -> None:
    files = sorted(KERNELS.rglob("*.cl"))
    assert len(files) > 15
    for path in files:
        text = path.read_text()
        assert text == fragment(path.relative_to(KERNELS).as_posix())
        assert text.startswith(f"// {path.name}:"), path
        assert "provides" in text, path
        assert len(text.splitlines()) <= 130, path
