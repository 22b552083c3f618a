"""Hold the error map of `lenscl map --error` against certified answers, scene by scene.

    python bench/validate_error_map.py --pixels 2500 [--seed N] [--scene PART]... [--keep FOLDER]

Prints a row a scene and precision: certified pixels that land in the map, how many of them have no bound and a bound,
how many of the bounds hold, the largest true error over its bound (worst), and how many times the true error the bound
is (loose; median and 99 %: errors that happen to be tiny). Pixels are drawn at random among those that meet a lens, one
in ten from the rest; those that the oracle cannot decide are left out and counted. A ray takes 2 to 20 ms to certify,
so 10^5 take about ten minutes; `--keep` stores the certified answers for another run.

    python bench/validate_error_map.py --long 110 --pixels 1000 --seed 7

does the same on scenes drawn at random whose rays meet two to four lenses, see bench/long_paths.py; and

    python bench/validate_error_map.py --overlaps 12 --pixels 300

on solids that lie in one another, touch and overlap; twice so many are drawn at random, see bench/overlaps.py.
"""

from __future__ import annotations

import argparse
import hashlib
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from itertools import chain
from pathlib import Path
from typing import Any

import numpy as np
import tomli_w
from long_paths import long_paths
from numpy.typing import NDArray
from overlaps import arrangements, cements, overlaps

import lenscl
from lenscl.accuracy import error_at
from lenscl.accuracy.bench import scene_files
from lenscl.config import Scene
from lenscl.lenses import catalogue
from lenscl.reference.oracle import prove_pixels
from lenscl.tracing import RayMap

PRECISIONS = ("double", "mixed", "single")
_SEED = 5  # the numbers of ulps were chosen on the pixels that it draws
_MISSES = 0.1  # share of the pixels that meet no lens
_SIDE = 256  # of the films made here, in pixels

_TURNED = {"rotate": [20.0, 30.0, 10.0]}
_UNLIKE = {  # what they are by default is another surface of the catalogue
    "ellipsoid": {"a": 0.9, "b": 0.7, "c": 0.5},
    "even_asphere_singlet": {"A4": 0.1, "A6": -0.05, "B4": 0.08},
}
_BALL = {"surface": "sphere", "name": "ball", "r": 0.4, "centre": [0.1, 0.0, 0.9], "n": 1.5}
_RING = {"surface": "torus", "name": "ring", "R": 0.6, "r": 0.2, "centre": [0.0, 0.1, -0.2], "n": 1.7, **_TURNED}
_EGG = {"surface": "ellipsoid", "name": "egg", "c": 0.5, "r": 0.5, "centre": [-0.1, 0.0, -1.4], "n": 1.3}
_TORUS = {"surface": "torus", "n": 1.5, **_TURNED}
_HEART = {"surface": "heart", "n": 1.5, "rotate": [-90.0, -90.0, 0.0]}
_BIFOLIA = {"surface": "bifolia", "n": 1.5, "centre": [0.0, -0.375, 0.0]}
_SPHERE = {"surface": "sphere", "n": 1.5, "r": 0.8}
_GLASS = {"medium.n": 1.5}


def scenes() -> Iterator[tuple[str, Scene]]:
    """Yield the scenes by name: the benchmark's, every surface, and what is hard on rounding."""
    for name, path in scene_files().items():
        yield f"bench {name}", lenscl.load_study(path).scene
    for name in catalogue():
        yield name, made({"surface": name, "n": 1.5, **_TURNED, **_UNLIKE.get(name, {})})
    yield "three lenses", made(_BALL, _RING, _EGG)
    yield "many spheres", made(
        *({"surface": "sphere", "name": f"s{i}", "r": 0.35, "centre": [0.05 * i, 0.02, 1.5 - i], "n": 1.4 + 0.1 * i}
          for i in range(4))
    )  # fmt: skip
    yield (
        "quartic by expression",
        made({"surface": "x**4 + y**4 + z**4 - k", "k": 0.3, "bounds": [[-1, -1, -1], [1, 1, 1]], "n": 1.5, **_TURNED}),
    )
    for far in (10.0, 1000.0):
        yield f"sphere, {far:g} away in its own space", made(
            {"surface": f"x**2 + y**2 + z**2 - {2 * far}*x + k", "k": far**2 - 0.64, "centre": [-far, 0.0, 0.0],
             "bounds": [[far - 1, -1.0, -1.0], [far + 1, 1.0, 1.0]], "n": 1.5}
        )  # fmt: skip
    yield "diamond torus, reflections end", made({**_TORUS, "n": 2.417}, **{"effects.total_reflection": "end"})
    yield "diamond torus, 64 events", made({**_TORUS, "n": 2.417}, **{"numerics.max_events": 64})
    yield "diamond heart, 64 events", made({**_HEART, "n": 2.417}, **{"numerics.max_events": 64})
    yield "air torus in glass", made({**_TORUS, "n": 1.0}, **_GLASS)
    yield (
        "air ellipsoid in glass",
        made({"surface": "ellipsoid", "a": 0.8, "b": 0.7, "c": 0.5, "n": 1.0, **_TURNED}, **_GLASS),
    )
    yield "n = 1.000001", made({**_TORUS, "n": 1.000001})
    yield "n = 1", made({**_TORUS, "n": 1.0})
    yield "torus, n = 100", made({**_TORUS, "n": 100.0})
    yield "prism, n = 1000", made({"surface": "prism", "n": 1000.0, "rotate": [0.0, 45.0, 30.0]})
    yield "parallel heart", made(_HEART, **{"source": {"kind": "parallel", "direction": [0.1, -0.2, -1.0]}})
    yield "parallel torus, far", moved(_TORUS, (1e3, 2e3, -1e3), parallel=True)
    for far in (1e3, 1e6):
        for lens in (_TORUS, _HEART, _SPHERE):
            yield f"{lens['surface']}, offset {far:g}", moved(lens, (far, -0.7 * far, 0.3 * far))
    for k in (1e-3, 1e5):
        yield f"torus, scale {k:g}", scaled({**_TORUS, "R": 0.7 * k, "r": 0.25 * k}, k)
    yield "sphere squashed to 1e-3", made({**_SPHERE, "stretch": [1.0, 1.0, 1e-3]})
    yield "torus squashed to 1e-2", made({**_TORUS, "stretch": [1.0, 0.8, 1e-2], "rotate": [0.0, 70.0, 10.0]})
    yield "heart stretched", made({**_HEART, "stretch": [0.5, 1.3, 0.2]})
    yield (
        "source at 1e6",
        made(_TORUS, **{"source.at": [0.0, 3e5, 1e6], "film.right": [2.0, 0.0, 0.0], "film.down": [0.0, -2.0, 0.0]}),
    )
    yield (
        "source inside",
        made({**_SPHERE, "r": 1.0, "n": 1.3}, **{"source.at": [0.2, 0.1, 0.3], "film.centre": [0.0, 0.0, -0.2]}),
    )
    yield "sheared picture", made(_TORUS, **{"picture.right": [6.0, 0.0, 0.0], "picture.down": [5.9, -0.6, 0.0]})
    yield "picture at an angle", made(_TORUS, **{"picture.right": [1.0, 0.0, 6.0], "picture.centre": [0.0, 0.0, -4.0]})
    # Films so small that each ray is near what is singular
    yield "sphere's rim to 1e-6", aimed(_SPHERE, (0.8 / np.sqrt(1 - 0.04), 0.0, 0.0), 1e-6)
    yield "torus's rim", aimed({"surface": "torus", "n": 1.5}, (0.95, 0.1, 0.0), 1e-1)
    yield "heart's dimple to 1e-3", aimed(_HEART, (0.0, 1.0, 0.0), 1e-3, at=(0.3, 4.0, 1.0))
    yield "heart's tip to 1e-3", aimed(_HEART, (0.0, -0.9995, 0.0), 1e-3, at=(0.5, -4.0, 3.0))
    yield "heart's equator to 1e-4", aimed(_HEART, (0.1, 0.0, 0.0), 1e-4)
    along_x = {"picture.centre": [4.0, 0.0, 0.6], "picture.right": [0.0, 6.0, 0.0], "picture.down": [0.0, 0.0, -6.0]}
    prism = {"surface": "prism", "n": 1.5, "rotate": [0.0, 90.0, 0.0]}
    yield "prism's face grazed at 1e-3", made(
        prism,
        **along_x | {"source.at": [-4.0, 0.05, 0.604], "film.centre": [0.0, 0.1, 0.6], "film.right": [0.0, 0.3, 0.0],
           "film.down": [0.5, 0.0, 0.0], "picture.centre": [-6.0, 0.0, 0.6]},
    )  # fmt: skip
    critical = 0.6 / np.sqrt(1.5**2 - 1.0)  # off the axis, where a ray from the middle leaves the prism's end
    yield "prism's critical angle to 1e-6", made(
        prism,
        **along_x | {"source.at": [0.0, 0.0, 0.0], "film.centre": [float(np.sqrt(critical**2 - 0.09)), -0.3, 0.6],
           "film.right": [1e-6, 0.0, 0.0], "film.down": [0.0, -1e-6, 0.0]},
    )  # fmt: skip
    plate = {"surface": "max(abs(x) - 1, abs(y) - 1, abs(z) - 0.05)", "bounds": [[-1.1] * 3, [1.1] * 3], "n": 1.5}
    for span in (0.004, 0.0004):
        yield f"plate grazed at {span / 4:g}", made(
            plate,
            **along_x | {"source.at": [-4.0, 0.05, 0.05 + span], "film.centre": [0.0, 0.1, 0.05],
                         "film.right": [0.0, 0.3, 0.0], "film.down": [0.5, 0.0, 0.0]},
        )  # fmt: skip
    yield "bifolia's pinch to 1e-3", aimed(_BIFOLIA, (0.0, -0.375, 0.0), 1e-3)


def made(*lenses: Mapping[str, Any], **changes: Any) -> Scene:
    """Return a scene of lenses before the benchmark's screens, with parts replaced by key."""
    document: dict[str, Any] = {
        "source": {"kind": "point", "at": [0.0, 0.0, 4.0]},
        "film": {"centre": [0.0, 0.0, 2.5], "right": [0.8, 0.0, 0.0], "down": [0.0, -0.8, 0.0], "size": [_SIDE, _SIDE]},
        "picture": {"centre": [0.0, 0.0, -2.5], "right": [6.0, 0.0, 0.0], "down": [0.0, -6.0, 0.0]},
        "medium": {"n": 1.0},
        "effects": {"total_reflection": "follow"},
        "numerics": {"max_events": 16},
        "lens": [dict(lens) for lens in lenses],
    }
    for key, value in changes.items():
        table, _, name = key.partition(".")
        if name:
            document[table][name] = value
        else:
            document[table] = value
    return lenscl.scene_from_toml(tomli_w.dumps(document))


def moved(lens: Mapping[str, Any], by: tuple[float, float, float], parallel: bool = False) -> Scene:
    """Return a scene with everything far from the origin."""

    def at(x: float, y: float, z: float) -> list[float]:
        return [x + by[0], y + by[1], z + by[2]]

    source = {"kind": "parallel", "direction": [0.05, 0.1, -1.0]} if parallel else {"kind": "point", "at": at(0, 0, 4)}
    centres = {"film.centre": at(0, 0, 2.5), "picture.centre": at(0, 0, -2.5)}
    return made({**lens, "centre": at(0, 0, 0)}, source=source, **centres)


def scaled(lens: Mapping[str, Any], k: float) -> Scene:
    """Return a scene of another size; the lens is given in its own."""
    film = {"film.centre": [0, 0, 2.5 * k], "film.right": [0.8 * k, 0, 0], "film.down": [0, -0.8 * k, 0]}
    picture = {"picture.centre": [0, 0, -2.5 * k], "picture.right": [6 * k, 0, 0], "picture.down": [0, -6 * k, 0]}
    return made(lens, **{"source.at": [0, 0, 4 * k]}, **film, **picture)


def aimed(
    lens: Mapping[str, Any], target: tuple[float, float, float], span: float, at: tuple[float, float, float] = (0, 0, 4)
) -> Scene:
    """Return a scene whose film is a small window on a place, as seen from the source."""
    film = {"film.centre": list(map(float, target)), "film.right": [span, 0.0, 0.0], "film.down": [0.0, -span, 0.0]}
    return made(lens, **{"source.at": list(map(float, at))}, **film)


def some_pixels(scene: Scene, count: int, seed: int = _SEED) -> NDArray[np.intp]:
    """Draw pixels, most of them among those that meet a lens."""
    rng = np.random.default_rng(seed)
    meets = lenscl.trace(scene).events.ravel() > 0
    hits, misses = rng.permutation(np.flatnonzero(meets)), rng.permutation(np.flatnonzero(~meets))
    some_misses = misses[: max(count - len(hits), int(_MISSES * count))]
    return np.sort(np.concatenate([hits[: count - len(some_misses)], some_misses]))


def truth(scene: Scene, pixels: NDArray[np.intp], keep: Path | None) -> dict[str, NDArray[Any]]:
    """Return the certified ends of pixels: status (-1 undecidable), events, and places as two doubles a number."""
    key = hashlib.sha256(scene.to_toml().encode() + pixels.tobytes()).hexdigest()[:16]
    file = keep / f"{key}.npz" if keep else None
    if file is not None and file.exists():
        with np.load(file) as stored:
            return dict(stored)
    status, events = np.full(len(pixels), -1), np.zeros(len(pixels), int)
    high, low = np.zeros((2, len(pixels), 2))
    for i, proof in enumerate(prove_pixels(scene, pixels.tolist())):
        if proof.status is None:
            continue
        status[i], events[i] = proof.status, proof.events
        for j, ball in enumerate(proof.st or ()):
            high[i, j] = float(ball.mid())
            low[i, j] = float((ball - high[i, j]).mid())  # exact to 1e-20: a doubled double
    found = {"status": status, "events": events, "high": high, "low": low}
    if file is not None:
        np.savez(file, **found)
    return found


@dataclass(frozen=True)
class Verdict:
    """How the bounds of one map did, over its certified pixels that land, in the map and in truth."""

    certified: int  # pixels
    without: int  # bound
    ratios: NDArray[np.float64]  # true error over bound; infinite where the ray in truth lands nowhere

    def row(self) -> str:
        held = int((self.ratios <= 1.0).sum())
        share = 100.0 * held / max(len(self.ratios), 1)
        loose = 1.0 / np.maximum(self.ratios, 1e-9)
        median, high = np.quantile(loose, (0.5, 0.99)) if len(loose) else (0.0, 0.0)
        worst = self.ratios.max(initial=0.0)
        return (
            f"{self.certified:9} {self.without:9} {len(self.ratios):9} {held:9} {share:9.4f} {worst:8.3f} "
            f"{median:8.1f} {high:8.0f}"
        )


def verdict(raymap: RayMap, pixels: NDArray[np.intp], found: Mapping[str, NDArray[Any]]) -> Verdict:
    """Hold the bounds of a map against the truth."""
    st, bound = raymap.st.reshape(-1, 2)[pixels].astype(np.float64), error_at(raymap, pixels)
    truly_lands = np.isin(found["status"], (0, 1))
    lands = np.isin(raymap.status.ravel()[pixels], (0, 1)) & (found["status"] >= 0)
    error = np.where(truly_lands, np.abs((st - found["high"]) - found["low"]).max(axis=1), np.inf)
    judged = lands & (bound >= 0)
    return Verdict(int(lands.sum()), int((lands & ~judged).sum()), error[judged] / bound[judged])


def main() -> None:
    reader = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    reader.add_argument("--pixels", type=int, default=2500, help="pixels a scene")
    reader.add_argument("--seed", type=int, default=_SEED, help="of the draw; another draws other pixels")
    reader.add_argument(
        "--scene", action="append", default=[], metavar="PART", help="only scenes with this in the name"
    )
    reader.add_argument("--long", type=int, metavar="N", help="so many scenes of long paths instead")
    reader.add_argument(
        "--overlaps", type=int, metavar="N", help="so many scenes of overlaps and of contact, and known arrangements"
    )
    reader.add_argument("--keep", type=Path, metavar="FOLDER", help="where certified answers are stored")
    asked = reader.parse_args()
    if asked.keep:
        asked.keep.mkdir(parents=True, exist_ok=True)
    head = "certified no-bound     bound      held         %    worst    loose 99%-loose"
    print(f"{'scene':34} {'precision':9} {head}", flush=True)
    everything: dict[str, list[Verdict]] = {precision: [] for precision in PRECISIONS}
    undecidable = 0
    asked_for = scenes() if asked.long is None else long_paths(asked.long, asked.seed)
    if asked.overlaps is not None:
        asked_for = chain(arrangements(), *(each(asked.overlaps, asked.seed) for each in (overlaps, cements)))
    for name, scene in asked_for:
        if asked.scene and not any(part in name for part in asked.scene):
            continue
        pixels = some_pixels(scene, asked.pixels, asked.seed)
        found = truth(scene, pixels, asked.keep)
        undecidable += int((found["status"] < 0).sum())
        for precision in PRECISIONS:
            judged = verdict(lenscl.trace(scene, precision=precision), pixels, found)
            everything[precision].append(judged)
            print(f"{name:34} {precision:9} {judged.row()}", flush=True)
    for precision, verdicts in everything.items():
        total = Verdict(
            sum(each.certified for each in verdicts),
            sum(each.without for each in verdicts),
            np.concatenate([each.ratios for each in verdicts] or [np.empty(0)]),
        )
        beyond = int((total.ratios > 1.0).sum())
        print(f"{'all':34} {precision:9} {total.row()}; {beyond} beyond")
    print(f"{undecidable} pixels were left out, as nobody can tell where they land")


if __name__ == "__main__":
    main()
