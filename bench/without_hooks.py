"""What the hooks of effects cost a scene that asks for none: its kernel against the same one without the hooks.

    python bench/without_hooks.py [ROUNDS]

A kernel has places where effects may be called, numbers that a surface holds ready for them, and layers for several
wavelengths. Where nothing is asked for these are empty, and a compiler has to see that. Here they are cut out of the
kernels' text, so that what is left is the engine alone; both are traced in turn on the close scenes of configs/bench,
in another order each round, and their ratio is taken pair by pair, by the device's clock. Maps have to be equal bit for
bit. What there is to see: 0.98 to 1.02, within the spread of a kernel against itself, which is measured beside it.
"""

from __future__ import annotations

import re
import sys
from dataclasses import replace

import numpy as np

from lenscl.accuracy.bench import scene_files
from lenscl.accuracy.statistics import median, median_bounds
from lenscl.config import Scene, load_study
from lenscl.device import Device, choose
from lenscl.tracing import kernel_source
from lenscl.tracing.job import Job

ROUNDS = 101
_SEED = 3
_EMPTY = r"static inline void {}\([^{{]*\{{\n\}}\n"  # a function that does nothing
# What is cut out of a text without comments, and what stands in its place; every pattern has to be found
_HOOKS = (
    (r"#define RAY_CARRIES *\n", ""),
    (r"  RAY_CARRIES\n", ""),
    (r"  realv length; *\n(?=  realv n_before)", ""),
    (r"  maskv lens; *\n  maskv leaves; *\n", ""),
    (r"  at\.(?:length|leaves|lens) = .*\n", ""),
    (_EMPTY.format("at_picture"), ""),
    (_EMPTY.format("store_effects"), ""),
    (r"  at_picture\(.*\n", ""),
    (r"  store_effects\(.*\n", ""),
    (r"#define (?:EFFECT|LAYER)_(?:PARAMETERS|ARGUMENTS) *\n", ""),
    (r" (?:EFFECT|LAYER)_(?:PARAMETERS|ARGUMENTS)", ""),
    (r"typedef struct \{\n(?:  int \w+; *\n){3}\} layer_t;\n", ""),
    (r"static inline layer_t layer_of_item\(.*\{\n(?:  .*\n)*\}\n", ""),
    (r"  const layer_t layer = .*\n", ""),
    (r"numbers\[layer\.number\]", "*numbers"),
    (r"layer\.item", "(int)get_global_id(0)"),
    (r"layer\.start \+ ", ""),
    (r" layer_t layer,", ""),
    (r" layer,", ""),
)
_PARKS = (
    (r"layer\.number \* room \+ ", ""),
    (r"parked\[layer\.number\]", "*parked"),
    (r"parked \+ layer\.number", "parked"),
)


def without_hooks(text: str) -> str:
    """Return a kernel's text without the places at which effects are called."""
    text = re.sub(r" *//.*|#line .*\n", "", text)
    hook = re.search(r"static inline void at_interface\([^{]*\{\n((?:  .*\n)?)\}\n", text)
    assert hook is not None, "there is no hook at a surface"
    called = hook[1].replace("(ray, at,", "(ray, &at,")
    text = text.replace(hook[0], "").replace("  at_interface(ray, &at, scene);\n", called)
    for pattern, instead in (*_HOOKS, *(_PARKS if "layer.number * room" in text else ())):
        text, count = re.subn(pattern, instead, text)
        assert count, f"{pattern}: is not in the kernel"
    left = re.findall(r"\b(?:EFFECT|LAYER|layer)\w*|RAY_CARRIES", text)
    assert not left, left
    return text


def compare(scene: Scene, device: Device, rounds: int) -> tuple[list[float], list[float], float]:
    """Return the ratios of a kernel to itself without hooks, and to itself, pair by pair; and nanoseconds a ray."""
    source = kernel_source(scene, device=device)
    bare = replace(source, text=without_hooks(source.text))
    jobs = [Job(scene, each, device, kind="bench") for each in (source, bare, source)]
    ends = [job.run_film() for job in jobs]
    for name, array in ends[0].items():
        np.testing.assert_array_equal(array, ends[1][name])
    times = np.zeros((rounds, len(jobs)))
    random = np.random.default_rng(_SEED)
    for turn in range(-3, rounds):  # the first ones warm up
        for number in random.permutation(len(jobs)):
            before = jobs[number].record()["trace_seconds"]
            jobs[number].run_film()
            if turn >= 0:
                times[turn, number] = jobs[number].record()["trace_seconds"] - before
    hooked, bare_times, again = times.T
    rays = scene.film.rows * scene.film.columns
    return (hooked / bare_times).tolist(), (hooked / again).tolist(), float(np.median(hooked)) / rays * 1e9


def main(rounds: int) -> None:
    """Print a row for each scene and precision."""
    device = choose()
    print(f"{device.label}; median of {rounds} paired rounds, with its 95 % bounds")
    print(f"{'':28}{'ns a ray':>9}   with hooks / without     with / with")
    for name, path in scene_files().items():
        if not name.endswith("close"):
            continue
        for precision in ("double", "single"):
            scene = load_study(path).scene.replace({"numerics.precision": precision})
            *ratios, ns = compare(scene, device, rounds)
            texts = [f"{median(some):.3f} ({'{:.3f} to {:.3f}'.format(*median_bounds(some))})" for some in ratios]
            print(f"{name:18}{precision:10}{ns:9.1f}   {'   '.join(texts)}", flush=True)


if __name__ == "__main__":
    main(int(sys.argv[1]) if len(sys.argv) > 1 else ROUNDS)
