"""Light on the picture where lenses are thinner than film pixels: nothing is lost but what the account says."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from scenes import make_scene

from lenscl import trace, trace_rays
from lenscl.config import Scene
from lenscl.status import RayStatus
from lenscl.tracing import Caustic
from lenscl.tracing.flux import flux_at
from lenscl.tracing.placement import Placement

NEEDLE = {"surface": "sphere", "r": 1.0, "stretch": [0.0008, 0.5, 0.0008], "rotate": [0.0, 0.0, 30.0]}
SLANTED = {"kind": "parallel", "direction": [0.2, -0.1, -1.0]}
ROUNDING = 1e-12


def caustic(*lenses: dict[str, Any], columns: int = 24, cells: int = 8, **more: Any) -> tuple[Scene, Caustic]:
    effects = {"caustics": True, **more.pop("effects", {})}
    scene = make_scene(
        *lenses, film={"size": [columns, columns]}, picture={"size": [cells, cells]}, effects=effects, **more
    )
    found = trace(scene).caustic
    assert found is not None
    assert sum(found.shares.values()) == pytest.approx(1.0, abs=1e-12)
    return scene, found


def shadow(scene: Scene, number: int = 0) -> float:
    """Return the light that straight rays carry to an ellipsoid; its outline lies on the film.

    A ray s + t w meets the unit ball where (s . w)^2 >= w . w (s . s - 1). In parallel light, with s at a right angle
    to w, that is s . s <= 1. Either is a conic in the place on the film, here an ellipse. The flux is integrated over
    it: in even steps around it, by Gauss's places across.
    """
    film, placement = scene.film, Placement.of(scene.lenses[number])
    scaled = placement.to_local / scene.lenses[number].values["r"]
    spans = np.stack([film.right, film.down, film.corner], axis=1)
    if scene.source.at is None:
        way = scaled @ np.asarray(scene.source.direction)
        way /= np.linalg.norm(way)
        start = scaled @ np.stack([film.right, film.down, np.asarray(film.corner) - placement.centre], axis=1)
        across = start - np.outer(way, way @ start)
        conic = np.diag([0.0, 0.0, 1.0]) - across.T @ across
    else:
        s = scaled @ (np.asarray(scene.source.at) - placement.centre)
        w = scaled @ (spans - np.outer(scene.source.at, [0.0, 0.0, 1.0]))
        conic = np.outer(s @ w, s @ w) - w.T @ w * (s @ s - 1.0)
    form, linear = -conic[:2, :2], conic[:2, 2]
    centre = np.linalg.solve(form, linear)
    height = conic[2, 2] + linear @ centre
    values, axes = np.linalg.eigh(form)
    assert (values > 0).all()
    ellipse = axes * np.sqrt(height / values)
    reach = np.abs(ellipse).sum(axis=1)
    assert ((centre - reach > 0) & (centre + reach < 1)).all()
    nodes, weights = np.polynomial.legendre.leggauss(40)
    radius, angle = (nodes + 1) / 2, 2 * np.pi * np.arange(80) / 80
    around = np.stack([np.cos(angle), np.sin(angle)], axis=1)
    places = centre + radius[:, None, None] * around @ ellipse.T
    points = np.asarray(film.corner) + places @ spans[:, :2].T
    dense = flux_at(scene, points) * film.rows * film.columns * abs(np.linalg.det(ellipse))
    return float((weights / 2 * radius) @ dense.sum(axis=1) * 2 * np.pi / 80)


@pytest.mark.parametrize("source", [None, SLANTED])
def test_a_needle_much_thinner_than_a_pixel_blocks_its_shadow(source: Any) -> None:
    needle = {**NEEDLE, "absorbs": True, "centre": [0.5, -0.25, 0.0] if source else [0.0, 0.0, 0.0]}
    scene, found = caustic(needle, columns=48, source=source)
    share = shadow(scene) / found.flux
    assert share > 1e-4
    assert found.not_excluded < share
    assert found.shares["blocked"] == pytest.approx(share, rel=0.05)
    assert abs(found.shares["blocked"] - share) <= found.not_excluded + ROUNDING


def some_ellipsoid(draw: np.random.Generator, source: Any) -> dict[str, Any]:
    """Return a needle, a plate, a fibre or a speck, somewhere in the light."""
    thin, long = 10 ** draw.uniform(-4.5, -1.5), 10 ** draw.uniform(-2, -0.7)
    stretch = [[thin, long, thin], [thin, long, long], [thin, thin, thin], [long, thin, thin / 3]][draw.integers(4)]
    z = draw.uniform(-1.0, 2.0)
    at = draw.uniform(-0.2, 0.2, 2)
    at = at * (4.0 - z) if source is None else at + (2.5 - z) * np.array([0.2, -0.1])
    return {
        "surface": "sphere", "r": 1.0, "stretch": stretch, "rotate": draw.uniform(0, 180, 3).tolist(),
        "centre": [*at.tolist(), z], "absorbs": True,
    }  # fmt: skip


def test_no_thin_solid_blocks_less_than_its_shadow_but_by_what_the_account_says() -> None:
    draw = np.random.default_rng(3)
    for number in range(12):
        columns = int(draw.integers(3, 30))
        source = SLANTED if number % 4 == 3 else None
        scene, found = caustic(some_ellipsoid(draw, source), columns=columns, source=source)
        share = shadow(scene) / found.flux
        blocked = found.shares["blocked"]
        assert abs(blocked - share) <= found.not_excluded + ROUNDING, (number, blocked, share, found.not_excluded)
        assert found.not_excluded < 0.03
        assert blocked == pytest.approx(share, rel=0.25, abs=1e-7)


def test_slits_finer_than_pixels_block_what_they_do() -> None:
    """In light along their plane, on films of a few pixels: sin(60 x) > 0.2 over their width."""
    comb = {
        "surface": "max(max(0.2 - sin(60*x), abs(z) - 0.01), max(abs(x), abs(y)) - 0.9)",
        "bounds": [[-1, -1, -0.02], [1, 1, 0.02]],
        "absorbs": True,
    }
    straight = {"kind": "parallel", "direction": [0.0, 0.0, -1.0]}
    x = (np.arange(2_000_000) + 0.5) / 2_000_000 * 1.3 - 0.65
    share = float((np.sin(60 * x) > 0.2).mean())
    for columns in (7, 16):
        _, found = caustic(comb, columns=columns, source=straight)
        assert abs(found.shares["blocked"] - share) <= found.not_excluded + 1e-6
        assert found.shares["blocked"] == pytest.approx(share, abs=2e-3)
        assert found.not_excluded < 0.3


def moved(scene: Scene, side: int) -> tuple[float, float]:
    """Return what a fibre absorbs and reflects of the light, by rays in squares of the part of the film that it covers.

    The film faces z. It is looked at between the outermost places to which its box goes in a straight line.
    """
    film, source = scene.film, np.asarray(scene.source.at)
    corners = Placement.of(scene.lenses[0]).corners()
    places = source + (corners - source) * ((film.corner[2] - source[2]) / (corners - source)[:, 2])[:, None]
    low, high = places[:, :2].min(axis=0), places[:, :2].max(axis=0)
    row, column = np.indices((side, side)) + 0.5
    x, y = low[0] + (high - low)[0] * column.ravel() / side, low[1] + (high - low)[1] * row.ravel() / side
    directions = np.stack([x, y, np.full(x.shape, film.corner[2])], axis=1) - source
    paths = trace_rays(
        scene.replace({"effects.caustics": False}), np.broadcast_to(source, directions.shape), directions
    )
    flux = -directions[:, 2] / np.linalg.norm(directions, axis=1) ** 3 * np.prod(high - low) / side**2
    left = paths.transmittance.astype(float)
    return float((flux * left * (1 - paths.transmission[:, 1])).sum()), float((flux * (1 - left)).sum())


def test_a_fibre_of_a_third_of_a_pixel_moves_all_that_it_meets() -> None:
    fibre = {"surface": "sphere", "r": 1.0, "stretch": [0.014, 0.5, 0.014], "rotate": [10.0, 5.0, 30.0], "n": 1.5}
    scene, found = caustic(
        {**fibre, "absorption": [8.0, 8.0, 8.0]}, columns=15, effects={"fresnel": True}, numerics={"max_events": 4}
    )
    pixel = 1.3 / 15 * 4.0 / 1.5  # where the fibre is
    assert pixel / 3 * 1.2 > 0.028
    for end, share in zip(("absorbed", "reflected"), np.array(moved(scene, 1000)) / found.flux, strict=True):
        assert share > 1e-4
        assert found.shares[end] == pytest.approx(share, rel=0.05)
        assert abs(found.shares[end] - share) <= found.not_excluded
    assert found.bent == 0.0


def test_light_that_is_bent_before_it_may_meet_a_needle_is_named_in_the_account() -> None:
    ball = {"surface": "sphere", "name": "ball", "r": 0.4, "n": 1.5, "centre": [0.0, 0.0, 0.5]}
    needle = {**NEEDLE, "name": "needle", "absorbs": True, "centre": [0.0, 0.0, -0.6]}
    _, alone = caustic(ball, columns=9)
    assert alone.bent == 0.0
    scene, found = caustic(ball, needle, columns=9)
    rest = found.not_excluded - found.bent
    assert found.bent == pytest.approx(shadow(scene, 0) / found.flux, abs=2 * rest)
    _, fine = caustic(ball, needle, columns=90)
    assert abs(found.shares["blocked"] - fine.shares["blocked"]) <= found.not_excluded + fine.not_excluded - fine.bent


def test_light_that_an_edge_parts_is_in_the_account_though_no_outline_is_in_sight() -> None:
    """A roof wider than the light: each slope sends light to its own side of a narrow picture, and little onto it."""
    roof = {"surface": "prism", "apex": 140.0, "stretch": [3.0, 3.0, 3.0], "rotate": [90.0, 0.0, 20.0], "n": 1.5}
    scene = make_scene(
        roof,
        source={"kind": "parallel", "direction": [0.03, 0.01, -1.0]},
        film={"size": [5, 5]},
        picture={"corner": [-0.1, 0.1, -4.5], "right": [0.2, 0.0, 0.0], "down": [0.0, -0.2, 0.0], "size": [64, 64]},
        effects={"caustics": True},
    )
    found = trace(scene).caustic
    assert found is not None
    side = 700
    ends = trace(scene.replace({"effects.caustics": False, "film.size": [side, side]})).status
    share = float((ends == RayStatus.PICTURE).mean())
    assert share > 1e-3
    assert found.bent == 0.0
    assert found.not_excluded < 0.01
    assert abs(found.shares["picture"] - share) > 2e-5  # an edge is in sight, or nothing is shown
    assert abs(found.shares["picture"] - share) <= found.not_excluded
