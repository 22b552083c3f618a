"""Mixed precision: found in single, and as exact as double."""

from __future__ import annotations

from dataclasses import replace
from itertools import product
from typing import Any

import numpy as np
import pytest
from probe import optimised_device
from scenes import make_scene
from thinned import thinned

from lenscl import RayStatus, codegen, trace
from lenscl.codegen import fragment
from lenscl.config import Scene
from lenscl.tracing import kernel_source

BOUNDS = [[-1.2] * 3, [1.2] * 3]
LENSES: dict[str, dict[str, Any]] = {
    "torus": {"surface": "torus"},
    "bifolia": {"surface": "bifolia"},
    "heart": {"surface": "heart", "rotate": [-90.0, -90.0, 0.0]},
    "gyroid": {
        "surface": "max(abs(sin(4*x)*cos(4*y) + sin(4*y)*cos(4*z) + sin(4*z)*cos(4*x)) - 0.3,"
        " x**2 + y**2 + z**2 - 0.8)",
        "bounds": BOUNDS,
    },
}


def scene_of(name: str, **numerics: Any) -> Scene:
    return make_scene(LENSES[name], film={"size": [96, 80]}, numerics=numerics)


@pytest.mark.parametrize(
    ("name", "method"),
    thinned(
        product(LENSES, ("auto", "interval", "march")),
        [*((name, "auto") for name in LENSES), ("torus", "interval"), ("torus", "march")],
    ),
)
def test_mixed_meets_what_double_meets_and_is_as_exact(name: str, method: str) -> None:
    mixed = trace(scene_of(name), method=method, precision="mixed")
    double = trace(scene_of(name), method=method, precision="double")
    assert mixed.st.dtype == np.float64
    decided = (mixed.status != RayStatus.UNDECIDED) & (double.status != RayStatus.UNDECIDED)
    met = decided & (double.events > 0)
    assert met.sum() > 900
    alike = (mixed.events == double.events) & (mixed.status == double.status)
    assert alike[met].mean() > (0.995 if method == "march" else 0.9995)  # the march may lose other thin chords
    error = np.abs(mixed.st - double.st).max(axis=-1)[met & alike]
    assert np.median(error) < 1e-12
    single = trace(scene_of(name), method=method, precision="single")
    both = met & alike & (single.events == double.events)
    assert np.median(np.abs(single.st - double.st).max(axis=-1)[both]) > 1e3 * max(np.median(error), 1e-16)


@pytest.mark.parametrize("width", [1, 2, 8])
def test_every_width_finds_the_same(width: int) -> None:
    narrow = optimised_device(width, width)
    for name in ("torus", "heart"):
        here = trace(scene_of(name, precision="mixed"), device=narrow)
        best = trace(scene_of(name, precision="mixed"))
        assert (here.events == best.events).mean() > 0.999
        assert np.median(np.abs(here.st - best.st)) < 1e-13


def test_only_what_is_searched_step_by_step_is_searched_in_single() -> None:
    torus = kernel_source(scene_of("torus", precision="mixed")).text
    assert "root_mixed.cl" in torus
    assert "words_single.cl" in torus
    quadric = kernel_source(make_scene({"surface": "sphere"}, numerics={"precision": "mixed"}))
    assert "words_single.cl" not in quadric.text
    both = kernel_source(
        make_scene(
            {"surface": "sphere", "name": "ball", "r": 0.2, "centre": [0, 0, 1.5]},
            {"surface": "torus", "name": "ring"},
            numerics={"precision": "mixed"},
        )
    )
    assert both.text.count('#line 1 "search_quadratic.cl"') == 1
    assert both.text.count('#line 1 "search_polynomial.cl"') == 1


def test_words_that_are_doubled_are_all_given_back() -> None:
    def words(name: str, directive: str) -> list[str]:
        return [line.split()[1] for line in fragment(name).splitlines() if line.startswith(directive)]

    assert words("words_single.cl", "#define") == words("words_double.cl", "#undef")
    assert len(words("words_single.cl", "#define")) > 20


def test_without_the_last_steps_in_double_it_would_be_as_wrong_as_single(monkeypatch: pytest.MonkeyPatch) -> None:
    scene = scene_of("torus", precision="mixed")
    double = trace(scene, precision="double")
    structure = kernel_source(scene).structure
    source = codegen.kernel_source(structure)
    polish = "SURFACE(polish)(search, shape, SURFACE(TOLERANCE), &root);"
    broken = replace(source, text=source.text.replace(polish, ";"))
    assert broken.text != source.text

    whole = trace(scene)
    monkeypatch.setattr(codegen, "kernel_source", lambda structure: broken)
    coarse = trace(scene)
    same = (coarse.events == double.events) & (double.events > 0)
    assert np.median(np.abs(coarse.st - double.st)[same]) > 1e-10
    assert np.median(np.abs(whole.st - double.st)[same]) < 1e-13


def test_a_ray_that_single_cannot_decide_is_decided_in_double() -> None:
    scene = scene_of("bifolia", precision="mixed").replace({"film.size": [256, 256]})
    mixed = trace(scene)
    assert mixed.escalated > 10
    assert (mixed.status == RayStatus.UNDECIDED).sum() <= (trace(scene, precision="double").status == 5).sum()
