"""What each effect of a scene costs: it is traced with and without it, in turn.

What is done beside the kernel is timed by itself: it comes on top of a map that is there.
"""

from __future__ import annotations

from dataclasses import dataclass
from time import perf_counter

import numpy as np

from lenscl.accuracy.front import coarser
from lenscl.accuracy.statistics import median, median_bounds
from lenscl.config import Scene
from lenscl.device import Device
from lenscl.tracing import BESIDE, RayMap, calls, trace, trace_without

ROUNDS = 9
BESIDE_ROUNDS = 3  # of what takes seconds, most of it on the host
_SEED = 11  # of the order within the rounds


@dataclass(frozen=True, slots=True, kw_only=True)
class Cost:
    """What one fragment adds to the time of a film's ray, in nanoseconds by the device's clock.

    What is done beside the kernel is timed by the host's clock.

    Attributes
    ----------
    ns : float
        Median over the rounds of the difference between a trace with it and one without.
    low, high : float
        95 % bounds of that median; of what is done beside the kernel, the least and the most.
    changed : float
        Share of the rays that end otherwise without it: what they then cost is in the difference, too.
    """

    ns: float
    low: float
    high: float
    changed: float


@dataclass(frozen=True, slots=True, kw_only=True)
class Ablation:
    """A scene's time and what its effects have in it.

    Attributes
    ----------
    ns : float
        Nanoseconds a ray of the film with all effects, the median; all its wavelengths together.
    costs : mapping of str to Cost
        By the name of the variant, or by the key of an effect beside the kernel.
    rays, rounds : int
        Of the film that was traced, and how often.
    """

    ns: float
    costs: dict[str, Cost]
    rays: int
    rounds: int


def ablate(scene: Scene, device: Device, rounds: int = ROUNDS) -> Ablation:
    """Time a scene with all that it calls for, and with one fragment less, for each.

    Parameters
    ----------
    scene : Scene
        With its method and precision; a large film is made coarser.
    device : Device
    rounds : int
        How often all take turns, in another order each time.
    """
    scene = coarser(scene)
    names = ["", *(call.variant.name for call in calls(scene) if call.variant is not None and call.is_in)]
    rays = scene.film.rows * scene.film.columns
    times = {name: [0.0] * rounds for name in names}
    random = np.random.default_rng(_SEED)
    for turn in range(-1, rounds):  # the first warms up
        for name in random.permutation(names).tolist():
            raymap = trace_without(scene, name, device=device) if name else trace(scene, device=device)
            if turn >= 0:
                times[name][turn] = raymap.trace_seconds / rays * 1e9
    whole, costs = trace(scene, device=device), {}
    for name in names[1:]:
        less = trace_without(scene, name, device=device)
        changed = ((less.status != whole.status) | (less.events != whole.events)).mean()
        apart = [with_it - without for with_it, without in zip(times[""], times[name], strict=True)]
        low, high = median_bounds(apart)
        costs[name] = Cost(ns=median(apart), low=low, high=high, changed=float(changed))
    costs |= {call.effect.key: _beside(whole, call.effect.key, rays) for call in calls(scene) if call.is_beside}
    return Ablation(ns=median(times[""]), costs=costs, rays=rays, rounds=rounds)


def _beside(raymap: RayMap, key: str, rays: int) -> Cost:
    """Time what an effect adds to a map that is traced; its kernels are built in a first round that does not count."""
    times = []
    for _ in range(BESIDE_ROUNDS + 1):
        start = perf_counter()
        BESIDE[key](raymap)
        times.append((perf_counter() - start) * 1e9 / rays)
    counted = times[1:]
    return Cost(ns=median(counted), low=min(counted), high=max(counted), changed=0.0)
