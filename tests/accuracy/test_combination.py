"""The ways to trace a scene that are tried."""

from __future__ import annotations

from dataclasses import replace

import pytest
from scenes import make_scene

from lenscl.accuracy.combination import Combination, every_combination, forerunner, precisions_of, serving, steps
from lenscl.device import choose

GYROID = {"surface": "max(sin(3*x)*cos(3*y), x**2 + y**2 + z**2 - 1)", "bounds": [[-2, -2, -2], [2, 2, 2]]}
TWO = ({"name": "a", "surface": "torus"}, {"name": "b", "surface": "heart", "centre": [0.0, 0.0, -2.0]})


def test_every_method_precision_step_and_rule_is_among_them() -> None:
    scene, device = make_scene({"surface": "torus"}), choose()
    found = every_combination(scene, device)
    assert len(found) == len(set(found)) >= 20
    exact = {(each.method, each.precision) for each in found if each.snell == "exact"}
    assert exact == {(m, p) for m in ("polynomial", "guarded", "interval", "march") for p in precisions_of(device)}
    assert len({each.step for each in found if each.method == "march"}) >= 4
    assert {each.tolerance for each in found} == {None, 1e-3, 1e-6}
    assert {each.snell for each in found} == {"exact", "paraxial"}
    assert forerunner(device) in found


@pytest.mark.parametrize(
    ("lenses", "names"),
    [
        (({"surface": "torus"},), ["polynomial", "march", "guarded", "interval"]),
        ((GYROID,), ["interval", "march"]),
        (TWO, ["auto", "march", "interval"]),  # a torus is a polynomial, the heart is none
    ],
)
def test_the_methods_that_serve_a_scene(lenses: tuple[dict[str, object], ...], names: list[str]) -> None:
    assert serving(make_scene(*lenses)) == names


def test_a_scene_is_traced_as_a_combination_says_whatever_it_asked_for() -> None:
    march = Combination(method="march", precision="single", step=0.05, tolerance=1e-3, snell="paraxial")
    for numerics in ({"accuracy": "1 px"}, {"method": "interval", "precision": "mixed"}):
        found = march.of(make_scene({"surface": "torus"}, numerics=numerics)).numerics
        assert (found.method, found.precision, found.step, found.tolerance) == ("march", "single", 0.05, 1e-3)
        assert (found.snell, found.accuracy, found.max_events) == ("paraxial", None, 16)


def test_numerics_are_the_keys_of_a_study() -> None:
    march = Combination(method="march", step=0.05)
    assert march.numerics() == {"method": "march", "precision": "double", "snell": "exact", "step": 0.05}
    assert make_scene({"surface": "torus"}, numerics=march.numerics()).numerics.step == 0.05


@pytest.mark.parametrize("scale", [1e-4, 1.0, 1e5])
def test_steps_suit_the_lens_and_never_take_for_ever(scale: float) -> None:
    scene = make_scene({"surface": "sphere", "stretch": [scale] * 3})
    found = list(steps(scene))
    assert found == sorted(found, reverse=True)
    across = 2 * 3**0.5 * scale
    assert all(step >= across / 10_500 for step in found)
    assert (0.01 in found) == (scale < 10)
    assert sum(across / 400 < step < across / 9 for step in found) >= 3


def test_combinations_are_told_apart_by_their_texts() -> None:
    march = Combination(method="march", step=0.01)
    every = [march, replace(march, tolerance=1e-3), replace(march, snell="paraxial"), replace(march, precision="mixed")]
    assert len({str(each) for each in every}) == len(every)
