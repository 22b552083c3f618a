"""Error bounds hold where solids lie in one another, touch and overlap, and count surfaces that are no events."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from overlaps import arrangements, overlaps
from validate_error_map import made, truth

from lenscl import RayStatus
from lenscl.accuracy import NO_BOUND, Places, media, passing, pixel_bounds, place_bounds
from lenscl.accuracy.meeting import Glass
from lenscl.config import Scene
from lenscl.reference.oracle import prove_rays
from lenscl.tracing import Nudge

NAMES = (
    "bubble of priority",
    "cemented doublet",
    "prism cube of two glasses, turned",
    "liquid that overlaps its glass",
    "ring within a ball of priority",
    "three stacked windows",
)
PIXELS = 45
LANDED = [status for status in RayStatus if status.lands]


@pytest.fixture(scope="module")
def certified() -> dict[str, tuple[Scene, Places, Any]]:
    """Scenes by name, with the bounds of pixels whose rays meet a lens, and their certified ends."""
    chosen = {name: scene for name, scene in arrangements() if name in NAMES}
    chosen |= dict(overlaps(1, 5))  # with a solid whose F loses digits
    assert len(chosen) == len(NAMES) + 1
    found = {}
    for name, scene in chosen.items():
        places = pixel_bounds(scene, np.arange(3, scene.film.rows * scene.film.columns, 37))
        some = np.flatnonzero(places.events)[:: max(np.count_nonzero(places.events) // PIXELS, 1)]
        taken = Places(**{key: getattr(places, key)[some] for key in ("st", "status", "events", "bound")})
        found[name] = scene, taken, truth(scene, np.arange(3, 128 * 128, 37)[some], None)
    return found


def test_bounds_hold_where_solids_overlap_or_touch(certified) -> None:
    ratios, lost, landed = [], 0, 0
    for name, (_, places, found) in certified.items():
        truly = np.isin(found["status"], LANDED)
        has_bound = places.bound >= 0
        assert (truly[has_bound & (found["status"] >= 0)]).all(), name
        lands = truly & np.isin(places.status, LANDED)
        lost, landed = lost + int((lands & ~has_bound).sum()), landed + int(lands.sum())
        error = np.abs((places.st - found["high"]) - found["low"]).max(axis=1)
        each = error[lands & has_bound] / places.bound[lands & has_bound]
        assert len(each) > 15, name
        assert each.max() <= 1.0, name
        ratios.append(each)
    assert landed > 200
    assert lost < 0.05 * landed
    assert np.median(np.concatenate(ratios)) > 1 / 400


def test_media_that_do_not_explain_a_path_give_no_bound(certified, monkeypatch) -> None:
    """Where the lowest priority wins instead, a ball swallows its bubble."""
    scene, places, _ = certified["bubble of priority"]
    assert (places.events == 4).sum() > 10

    def lowest(self: media.Overlapping, solids: np.ndarray) -> np.ndarray:
        ranks = [np.where(solids[number], rank, 9) for number, rank in self._ranks.items()]
        least = np.min(ranks, axis=0)
        return np.where(least < 9, least, -1)

    monkeypatch.setattr(media.Overlapping, "_medium_of", lowest)
    again = pixel_bounds(scene, np.arange(3, scene.film.rows * scene.film.columns, 37))
    assert (again.bound[again.events == 4] == NO_BOUND).all()
    assert (again.events == 4).sum() > 10


@pytest.fixture(scope="module")
def corrugated() -> tuple[Scene, list[list[float]], list[list[float]]]:
    """Forty surfaces within a block of glass far from the origin, and rays along which each rounds the same way."""
    far = 1e6
    waves = "max(cos(w*z), max(abs(x), abs(y)) - 0.2)"
    inner = {"surface": waves, "w": 157.0, "bounds": [[-0.3, -0.3, -0.4], [0.3, 0.3, 0.4]]}
    outer = {"surface": "max(abs(x), abs(y), abs(z)) - 0.5", "bounds": [[-0.6] * 3, [0.6] * 3], "priority": 1}
    scene = made(
        {**inner, "surface": f"max({waves}, abs(z) - 0.39)", "name": "inner", "centre": [far, 0.0, 0.0], "n": 1.7},
        {**outer, "name": "outer", "centre": [far, 0.0, 0.0], "n": 1.5},
        **{"picture.centre": [far, 0.0, -1.0], "picture.right": [1.0, 0.0, 0.0], "picture.down": [0.0, -1.0, 0.0]},
    )
    slopes = [sign * part * 2.0**-33 / 0.02 for sign in (1, -1) for part in (0.3, 0.35, 0.4, 0.45)]
    return scene, [[far + 0.05, 0.03, 2.0]] * len(slopes), [[slope, 0.0, -1.0] for slope in slopes]


def beyond(corrugated: Any) -> np.ndarray:
    """Return which rays are farther off than their bounds."""
    scene, origins, directions = corrugated
    places = place_bounds(scene, origins, directions)
    proofs = prove_rays(scene, origins, directions)
    assert (places.events == 2).all()
    assert (places.bound > 0).all()
    off = [proof.distance(*place) for proof, place in zip(proofs, places.st, strict=True)]
    return np.array(off) > places.bound


def test_surfaces_within_a_medium_count(corrugated) -> None:
    assert not beyond(corrugated).any()


def test_without_them_bounds_would_not_hold(corrugated, monkeypatch) -> None:
    monkeypatch.setattr(media, "crossed", lambda glass, start, *rest: np.zeros(start.shape[1]))
    assert beyond(corrugated).sum() >= 4


@pytest.mark.parametrize(
    "lens",
    [
        {"surface": "sphere", "r": 0.5},
        {"surface": "torus", "R": 0.6, "r": 0.2, "rotate": [20.0, 30.0, 10.0]},
        {"surface": "max(cos(40*z), x**2 + y**2 - 0.25)", "bounds": [[-0.6] * 3, [0.6] * 3]},
    ],
)
def test_no_surface_on_a_leg_is_left_out(lens: dict[str, Any]) -> None:
    glass = Glass(made({**lens, "n": 1.5}), 0)
    start, end = np.random.default_rng(2).uniform(-0.8, 0.8, (2, 3, 400))
    at = np.linspace(0.0, 1.0, 4001)[:, None]
    signs = np.stack([passing.inside(glass, start + t * (end - start)) for t in at])
    changes = np.count_nonzero(signs[1:] != signs[:-1], axis=0)
    on = np.zeros(400, bool)
    counted = passing.crossed(glass, start, end, (signs[0], signs[-1]), (on, on))
    assert (counted >= changes).all()
    assert (counted <= changes + 4).all()
    assert (changes > 1).sum() > 40


def test_moved_indices_move_every_ratio_but_one() -> None:
    numbers = {"n_medium": 1.0, "lens_0.n": 1.5, "lens_1.n": 1.5, "lens_2.n": 1.7, "lens_3.n": 1.0}
    for by in (1e-3, -1e-3):
        moved = Nudge(turn=(0.0, 0.0, 0.0), eta_in=by, eta_out=0.0).of(numbers, nests=True)
        for a in numbers:
            for b in numbers:
                grown = (moved[a] / moved[b]) / (numbers[a] / numbers[b]) - 1.0
                if numbers[a] == numbers[b]:
                    assert moved[a] == moved[b]
                else:
                    assert abs(grown) >= 0.99e-3
                    assert (grown > 0) == ((numbers[a] > numbers[b]) == (by > 0))
