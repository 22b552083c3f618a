"""The engine alone, cut out of a kernel that asks for nothing: what bench/without_hooks.py times a kernel against."""

from __future__ import annotations

import re

import pytest
import without_hooks
from probe import plain_device
from scenes import make_scene

from lenscl.tracing import kernel_source


@pytest.mark.parametrize("surface", ["sphere", "torus"])  # without total reflection, and with it
def test_it_traces_as_the_whole_does(surface: str) -> None:
    scene = make_scene({"surface": surface}, film={"size": [24, 24]})
    (ratio,), (again,), ns = without_hooks.compare(scene, plain_device(), rounds=1)  # which holds the maps equal
    assert min(ratio, again, ns) > 0.0


def test_no_hook_is_left_in_it() -> None:
    text = kernel_source(make_scene({"surface": "torus"}), device=plain_device()).text
    bare = without_hooks.without_hooks(text)
    words = r"\b(?:at_interface|at_picture|store_effects|layer_t|RAY_CARRIES|EFFECT_\w+|LAYER_\w+)\b"
    assert len(set(re.findall(words, text))) >= 9
    assert re.findall(words, bare) == []
    with pytest.raises(AssertionError, match="is not in the kernel"):
        without_hooks.without_hooks(text.replace("numbers[layer.number]", "numbers[0]"))
