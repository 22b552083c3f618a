"""Scenes whose rays meet two to four lenses, drawn at random: for `validate_error_map.py`, which judges their bounds.

A family is a kind of hardness; each draw has other numbers. F loses digits to constants k that cancel, lenses stand far
from the origin and light gathers between them, lenses are tiny or of huge radii, rays graze, come back or are totally
reflected. Expressions have k and the radii as parameters, so that draws of a family share their programs.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import Any

import numpy as np

import lenscl
from lenscl.config import Scene

Rng = np.random.Generator
Lens = dict[str, Any]
_CENTRE = np.zeros(3)
_SIDE = 128  # of the films, in pixels


def long_paths(count: int, seed: int) -> Iterator[tuple[str, Scene]]:
    """Yield so many scenes by name, one family after the other."""
    rng = np.random.default_rng(seed)
    families = list(FAMILIES.items())
    for number in range(count):
        name, family = families[number % len(families)]
        yield f"{name} {number}", family(rng)


def noisy(rng: Rng, r: float, k: float, kind: int | None = None) -> Lens:
    """Return a solid of radius r or so, whose F loses digits to k."""
    texts = (
        "(x + k)**2 - k**2 - 2*k*x + y**2 + z**2 - r**2",
        "x**2 + y**2 + (z - k)**2 + 2*k*z - k**2 - r**2",
        "(x**2 + k)**2 - k**2 - 2*k*x**2 + y**4 + z**4 - r**4",
        "sqrt(k**2 + x**2 + y**2 + z**2) - sqrt(k**2 + r**2)",
        "(x**2 + y**2 + 2*z**2 - r**2)*k + k**2*(x + y) - k**2*x - k**2*y",
    )
    kind = int(rng.integers(len(texts))) if kind is None else kind
    if kind == 2:
        k = min(k, 1e6 * r * r)
    if kind == 3:
        k = min(k, 1e4)
    side = 1.3 * r
    return {"surface": texts[kind], "k": k, "r": r, "bounds": [[-side] * 3, [side] * 3]}


def clean(rng: Rng, r: float) -> Lens:
    """Return a solid of the catalogue of radius r or so, turned."""
    name = str(rng.choice(["sphere", "ellipsoid", "torus", "superellipsoid", "biconvex", "heart"]))
    turned = {"rotate": rng.uniform(-40.0, 40.0, 3).tolist()}
    shapes: dict[str, Lens] = {
        "sphere": {"r": r},
        "ellipsoid": {"r": r, "a": 1.0, "b": float(rng.uniform(0.6, 1.0)), "c": float(rng.uniform(0.4, 1.0)), **turned},
        "torus": {"R": 0.7 * r, "r": 0.25 * r, **turned},
        "superellipsoid": {"e1": 1.5, "e2": 1.0, "stretch": [r] * 3, **turned},
        "biconvex": {"R1": 2.0 * r, "R2": 2.5 * r, "thickness": 0.6 * r, "diameter": 1.6 * r},
        "heart": {"stretch": [0.7 * r] * 3, **turned},
    }
    return {"surface": name, **shapes[name]}


def _index(rng: Rng, high: float = 2.0) -> float:
    return float(rng.uniform(1.3, high))


def _power(rng: Rng, low: float, high: float) -> float:
    return float(10.0 ** rng.uniform(low, high))


def _scene(lenses: list[Lens], centre: np.ndarray = _CENTRE, **changes: Any) -> Scene:
    """Return a scene before screens in z; `centre` moves all of it."""
    from validate_error_map import made

    def at(place: Any) -> list[float]:
        return [float(x) for x in np.add(place, centre)]

    named = [{**lens, "name": f"lens{i}", "centre": at(lens.get("centre", (0, 0, 0)))} for i, lens in enumerate(lenses)]
    source = changes.pop("source", (0.0, 0.0, 4.0))
    film, span = changes.pop("film", (0.0, 0.0, 2.5)), changes.pop("span", 0.8)
    picture, side = changes.pop("picture", (0.0, 0.0, -6.0)), changes.pop("side", 12.0)
    start = {"kind": "parallel", "direction": list(source[1:])} if source[0] == "parallel" else {
        "kind": "point", "at": at(source)}  # fmt: skip
    screens = {
        "film.centre": at(film), "film.right": [span, 0.0, 0.0], "film.down": [0.0, -span, 0.0],
        "film.size": [_SIDE, _SIDE], "picture.centre": at(picture), "picture.right": [side, 0.0, 0.0],
        "picture.down": [0.0, -side, 0.0], "numerics.max_events": 24,
    }  # fmt: skip
    return made(*named, source=start, **screens)


def _stack(rng: Rng, makers: list[Callable[[float], Lens]], gap: float, high: float = 2.0) -> list[Lens]:
    """Return lenses one below the other, from z = 1 on."""
    lenses, z = [], 1.2
    for make in makers:
        r = float(rng.uniform(0.3, 0.6))
        aside = rng.uniform(-0.1, 0.1, 2)
        lens = make(r)
        lenses.append({**lens, "centre": [float(aside[0]), float(aside[1]), z - 1.3 * r], "n": _index(rng, high)})
        z -= 2.6 * r + gap
    return lenses


def _noisy_stack(rng: Rng) -> Scene:
    makers: list[Callable[[float], Lens]] = [
        (lambda r: noisy(rng, r, _power(rng, 1.0, 6.0))) if rng.random() < 0.6 else (lambda r: clean(rng, r))
        for _ in range(int(rng.integers(2, 5)))
    ]
    return _scene(_stack(rng, makers, float(rng.uniform(0.01, 0.5))))


def _noise_then_focus(rng: Rng) -> Scene:
    """A noisy lens gathers light into a tiny clean one."""
    lens = {**noisy(rng, 0.5, _power(rng, 2.0, 5.0), int(rng.integers(2))), "centre": [0.0, 0.0, 1.0], "n": 1.5}
    r = float(rng.uniform(0.03, 0.1))
    ball = {"surface": "sphere", "r": r, "centre": [0.0, 0.0, 0.25 - 1.5 * r], "n": _index(rng)}
    return _scene([lens, ball], source=("parallel", 0.0, 0.0, -1.0), span=0.1, picture=(0.0, 0.0, -0.5), side=0.5)


def _far_focus(rng: Rng) -> Scene:
    """Far from the origin, light is gathered by a ball into a tiny one."""
    centre = _power(rng, 3.0, 6.0) * rng.choice((-1.0, 1.0), 3) * rng.uniform(0.2, 1.0, 3)
    r, gap = float(rng.uniform(0.01, 0.1)), float(rng.uniform(1.45, 1.65))
    balls = [
        {"surface": "sphere", "r": 1.0, "n": 1.5, "name": "large"},
        {"surface": "sphere", "r": r, "centre": [0.0, 0.0, -max(gap, 1.001 + r)], "n": _index(rng)},
    ]
    source = ("parallel", 0.0, 0.0, -1.0) if rng.random() < 0.7 else (0.0, 0.0, 40.0)
    return _scene(
        balls, centre, source=source, span=1.5 * r, picture=(0.0, 0.0, -1.8), side=float(rng.uniform(0.01, 1))
    )


def _far_stack(rng: Rng) -> Scene:
    centre = _power(rng, 3.0, 6.0) * rng.choice((-1.0, 1.0), 3) * rng.uniform(0.2, 1.0, 3)
    makers: list[Callable[[float], Lens]] = [lambda r: clean(rng, r)] * int(rng.integers(2, 4))
    return _scene(_stack(rng, makers, 0.1), centre)


def _oval(rng: Rng) -> Scene:
    """A Cartesian oval gathers the source's light without aberration, and a small lens stands near that focus."""
    n, source, focus = _index(rng, 1.9), 4.0, float(rng.uniform(-1.0, -0.3))
    top = float(rng.uniform(0.7, 1.0))
    text = "max(sqrt(x**2 + y**2 + (z - a)**2) + n1*sqrt(x**2 + y**2 + (z - b)**2) - c, zc - z, x**2 + y**2 - 0.2)"
    oval = {
        "surface": text, "a": source, "b": focus, "n1": n, "c": source - top + n * (top - focus), "zc": 0.2, "n": n,
        "bounds": [[-0.5, -0.5, 0.1], [0.5, 0.5, 1.1]],
    }  # fmt: skip
    r = float(rng.uniform(0.03, 0.2))
    ball = {"surface": "sphere", "r": r, "centre": [0.01, 0.0, -0.05 - r], "n": _index(rng)}
    return _scene([oval, ball], span=0.25, picture=(0.0, 0.0, -2.0), side=2.0)


def _flat(rng: Rng) -> Scene:
    """Lenses of radii so huge that they are nearly plates."""
    lenses: list[Lens] = []
    z = 1.0
    for _ in range(int(rng.integers(2, 5))):
        radius = _power(rng, 3.0, 8.0)
        text = "max(x**2 + y**2 + (z + R - t)**2 - R**2, x**2 + y**2 + (z - R + t)**2 - R**2, x**2 + y**2 - 0.3)"
        kinds: list[Lens] = [
            {"surface": text, "R": radius, "t": 0.15, "bounds": [[-0.6, -0.6, -0.3], [0.6, 0.6, 0.3]]},
            {"surface": "conic_singlet", "c1": 1.0 / radius, "c2": -1.0 / radius, "thickness": 0.3, "diameter": 1.1},
            {"surface": "conic_singlet", "c1": 0.6, "c2": 1.0 / radius, "thickness": 0.3, "diameter": 1.1},
        ]
        turned = {"rotate": rng.uniform(-10.0, 10.0, 3).tolist()}
        lenses.append({**kinds[int(rng.integers(3))], **turned, "centre": [0.0, 0.0, z], "n": _index(rng)})
        z -= 0.7
    return _scene(lenses)


def _doublet(rng: Rng) -> Scene:
    """Two or three singlets of common faces, with gaps down to 1e-9."""
    gap = _power(rng, -9.0, -2.0)
    c, k = rng.uniform(-0.8, 0.8, 4).tolist(), rng.uniform(-1.0, 0.0, 4).tolist()
    lenses = []
    for i in range(int(rng.integers(2, 4))):
        faces = {"c2": c[i], "k2": k[i], "c1": c[i + 1], "k1": k[i + 1], "thickness": 0.4, "diameter": 1.0}
        place = {"centre": [0.0, 0.0, 0.8 - i * (0.4 + gap)], "n": _index(rng)}
        lenses.append({"surface": "conic_singlet", **faces, **place})
    return _scene(lenses, span=0.5)


def _dense(rng: Rng) -> Scene:
    """High indices: total reflections and many surfaces."""
    makers: list[Callable[[float], Lens]] = [lambda r: clean(rng, r), lambda r: clean(rng, r)]
    return _scene(_stack(rng, makers, 0.2, 4.0), side=20.0)


def _grazed(rng: Rng) -> Scene:
    """The film is a small window on a silhouette, behind another lens or before it."""
    r, k = 0.5, _power(rng, 0.0, 4.0)
    first = {**noisy(rng, r, k, int(rng.integers(2))), "centre": [0.0, 0.0, 0.8], "n": _index(rng)}
    second = {**clean(rng, 0.8), "centre": [0.2, 0.0, -1.2], "n": _index(rng)}
    distance = 3.2
    rim = r / np.sqrt(1.0 - (r / distance) ** 2)
    span = _power(rng, -6.0, -1.0)
    return _scene([first, second], film=(float(rim - 0.4 * span), 0.0, 0.8), span=span)


def _re_entry(rng: Rng) -> Scene:
    """Hollow and wavy lenses that rays leave and meet again."""
    wavy = {
        "surface": "max(x**2 + y**2 + z**2 - 0.5, 0.4 - k - x**2 - y**2 - (z + 0.2)**2 + k)",
        "k": _power(rng, 0.0, 5.0), "bounds": [[-0.8] * 3, [0.8] * 3], "centre": [0.0, 0.0, 0.6], "n": _index(rng),
    }  # fmt: skip
    ring = {"surface": "torus", "R": 0.6, "r": 0.2, "rotate": rng.uniform(-90.0, 90.0, 3).tolist()}
    return _scene([wavy, {**ring, "centre": [0.0, 0.1, -1.0], "n": _index(rng, 2.5)}])


def _tiny(rng: Rng) -> Scene:
    """A large lens and tiny ones in bounds that are much wider than they are."""
    r = _power(rng, -3.0, -1.0)
    text = "x**4 + y**4 + z**4 - r**4" if rng.random() < 0.5 else "x**2 + 2*y**2 + z**2 - r**2"
    tiny = {
        "surface": text,
        "r": r,
        "bounds": [[-0.5] * 3, [0.5] * 3],
        "centre": [0.3 * r, 0.0, -0.6],
        "n": _index(rng),
    }
    large = {"surface": "sphere", "r": 0.6, "centre": [0.0, 0.0, 0.9], "n": 1.4}
    return _scene([large, tiny], span=float(min(0.5, 4.0 * r)), picture=(0.0, 0.0, -1.5), side=3.0)


FAMILIES: dict[str, Callable[[Rng], Scene]] = {
    "noisy stack": _noisy_stack,
    "noise into a focus": _noise_then_focus,
    "far focus": _far_focus,
    "far stack": _far_stack,
    "oval": _oval,
    "huge radii": _flat,
    "doublet": _doublet,
    "dense": _dense,
    "grazed": _grazed,
    "re-entry": _re_entry,
    "tiny in wide bounds": _tiny,
}


if __name__ == "__main__":
    for name, scene in long_paths(2 * len(FAMILIES), 1):
        found = lenscl.trace(scene)
        print(f"{name:24}", np.bincount(found.events.ravel()), {k.name: v for k, v in found.counts().items() if v})
