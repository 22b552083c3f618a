"""Light on the picture against what needs no tubes: counts of rays, slabs of known loss, zoomed pictures."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from scenes import make_scene

from lenscl import RayStatus, trace, trace_rays
from lenscl.config import Scene
from lenscl.effects.colours import LUMINANCE
from lenscl.tracing import Caustic, RayMap, tubes

SOURCE = np.array([0.0, 0.0, 4.0])
NEAR = {"corner": [-1.0, 1.0, -2.5], "right": [2.0, 0.0, 0.0], "down": [0.0, -2.0, 0.0]}
SLAB = {
    "surface": "max(max(abs(x), abs(y)) - 2, abs(z) - h)",
    "bounds": [[-3, -3, -1], [3, 3, 1]],
    "h": 0.35,
}


def scene(*lenses: dict[str, Any], columns: int, cells: int = 12, **more: Any) -> Scene:
    effects = {"caustics": True, **more.pop("effects", {})}
    picture = {"size": [cells, cells], **more.pop("picture", {})}
    return make_scene(*lenses, film={"size": [columns, columns]}, picture=picture, effects=effects, **more)


def caustic(raymap: RayMap) -> Caustic:
    assert raymap.caustic is not None
    return raymap.caustic


def counted(asked: Scene, side: int) -> tuple[NDArray[np.float64], NDArray[np.int64]]:
    """Return the irradiance of random rays, one in each of side x side squares of the film, and how many a cell gets.

    The film faces z, as does the picture. A ray has the solid angle of its square: area, times the cosine, over the
    square of its distance.
    """
    film, picture = asked.film, asked.picture
    places = (np.indices((side, side)) + np.random.default_rng(7).random((2, side, side))) / side
    v, u = places.reshape(2, -1, 1)
    directions = np.asarray(film.corner) + u * np.asarray(film.right) + v * np.asarray(film.down) - SOURCE
    paths = trace_rays(
        asked.replace({"effects.caustics": False}), np.broadcast_to(SOURCE, directions.shape), directions
    )
    carried = (film.right[0] / side) ** 2 * -directions[:, 2] / np.linalg.norm(directions, axis=1) ** 3
    if "transmittance" in paths.added:
        carried *= paths.transmittance
    if "transmission" in paths.added:
        carried *= paths.transmission @ LUMINANCE
    lands = paths.status == RayStatus.PICTURE
    column, row = np.floor(paths.st[lands] * picture.size).astype(int).T
    shape = (picture.rows, picture.columns)
    numbers = row * picture.columns + column
    count = np.bincount(numbers, minlength=picture.rows * picture.columns).reshape(shape)
    light = np.bincount(numbers, carried[lands], picture.rows * picture.columns).reshape(shape)

    # What a cell gets by itself: the same, for it is small
    s, t = np.meshgrid((np.arange(picture.columns) + 0.5) / picture.columns, (np.arange(shape[0]) + 0.5) / shape[0])
    middles = np.asarray(picture.corner) + s[..., None] * picture.right + t[..., None] * picture.down - SOURCE
    area = picture.right[0] / picture.columns * -picture.down[1] / picture.rows
    return light / (area * -middles[..., 2] / np.linalg.norm(middles, axis=-1) ** 3), count


@pytest.mark.parametrize(
    ("lens", "columns", "close"),
    [
        ({"surface": "sphere"}, 6, 0.018),
        ({"surface": "torus", "rotate": [30, 20, 0]}, 8, 0.014),
        ({"surface": "sphere", "absorption": [0.5, 1.0, 2.0]}, 4, 0.0029),
    ],
    ids=["ball", "torus", "dark ball"],
)
def test_films_of_a_few_pixels_light_each_cell_as_counts_of_rays_do(
    lens: dict[str, Any], columns: int, close: float
) -> None:
    """Root mean square over cells: some 0.6 to 0.8 of what is allowed, half of that by the counts themselves."""
    asked = scene(lens, columns=columns, picture=NEAR, effects={"fresnel": "absorption" in lens})
    expected, count = counted(asked, 1200)
    assert count.min() > 100
    assert expected.max() > 3 * expected.mean()
    off = trace(asked).irradiance - expected
    assert np.sqrt((off**2).mean()) < close
    assert abs(off.mean() / expected.mean()) < 0.004


def test_a_tube_carries_the_mean_of_what_its_corners_let_on_and_not_of_its_factors() -> None:
    """Two triangles: of the first, corners let on 1 x 0, 0 x 1 and 0.5 x 0.5; of the second 0 x 1, 1 x 1, 0.5 x 0.5."""
    asked = scene({"surface": "sphere", "absorption": [1, 1, 1]}, columns=2, cells=4, effects={"fresnel": True})
    account = tubes.Account(asked, np.ones(1))
    corners = tubes.TubeRays(
        place=np.array([[[0.5, 0.5], [3.5, 0.5], [0.5, 3.5], [3.5, 3.5]]]),
        status=np.full((1, 4), RayStatus.PICTURE, np.uint8),
        events=np.full((1, 4), 2, np.uint8),
        refracted=np.array([[1.0, 0.0, 0.5, 1.0]]),
        left=np.array([[[0.0], [1.0], [0.5], [1.0]]]),
        gathered=np.ones((1, 4)),
    )
    account.add_tubes(corners, np.array([[3.0, 6.0]]))
    sent = np.ones((asked.picture.rows, asked.picture.columns))
    assert account.close(sent)[0].sum() == pytest.approx(3.0 * 0.25 / 3 + 6.0 * 1.25 / 3)
    assert account.ends["reflected"] == pytest.approx(3.0 * 1.5 / 3 + 6.0 * 1.5 / 3)
    assert sum(account.ends.values()) == pytest.approx(9.0)


@pytest.mark.parametrize("n", [1.2, 1.5, 2.4])
def test_a_slab_in_light_along_its_normal_loses_what_closed_forms_say(n: float) -> None:
    """Each surface lets on 1 - ((n - 1) / (n + 1))^2, and a length L exp(-a L)."""
    absorbs, thickness = np.array([0.3, 0.9, 2.0]), 0.7
    found = trace(
        scene(
            {**SLAB, "n": n, "absorption": absorbs.tolist()}, columns=5, cells=6,
            source={"kind": "parallel", "direction": [0.0, 0.0, -1.0]}, effects={"fresnel": True},
            picture={"corner": [-0.5, 0.5, -2.5], "right": [1.0, 0, 0], "down": [0, -1.0, 0]},
        )
    )  # fmt: skip
    refracted, left = (1 - ((n - 1) / (n + 1)) ** 2) ** 2, np.exp(-absorbs * thickness)
    shares = caustic(found).shares
    assert shares["reflected"] == pytest.approx(1 - refracted, abs=1e-6)
    assert shares["absorbed"] == pytest.approx(refracted * (1 - LUMINANCE @ left), abs=1e-6)
    assert shares["picture"] == pytest.approx(refracted * LUMINANCE @ left / 1.3**2, abs=1e-6)
    rgb = caustic(found).rgb
    assert rgb is not None
    np.testing.assert_allclose(rgb, np.broadcast_to(refracted * left, rgb.shape), atol=1e-6)


def test_without_fresnel_a_slab_absorbs_all_that_it_takes() -> None:
    found = trace(
        scene(
            {**SLAB, "absorption": [0.8, 0.8, 0.8]}, columns=5, cells=6,
            source={"kind": "parallel", "direction": [0.0, 0.0, -1.0]},
        )
    )  # fmt: skip
    assert caustic(found).shares["absorbed"] == pytest.approx(1 - np.exp(-0.8 * 0.7), abs=1e-6)
    assert caustic(found).shares["reflected"] == 0.0


@pytest.mark.parametrize(("lens", "close"), [({"surface": "sphere", "n": 1.0}, 0.025), ({"surface": "sphere"}, 0.1)])
def test_a_picture_that_is_zoomed_into_gets_the_light_of_its_place(lens: dict[str, Any], close: float) -> None:
    """Tubes reach thousands of millions of cells beyond it; each is even, and differs by so much from the next."""
    place = {"corner": [0.45, 0.35, -2.5], "right": [0.1, 0, 0], "down": [0, -0.1, 0]}
    expected = counted(scene(lens, columns=24, cells=1, picture=place), 1000)[0].item()
    for side in (1e-2, 1e-5, 1e-8, 1e-10):
        corner = [0.5 - side / 2, 0.3 + side / 2, -2.5]
        picture = {"corner": corner, "right": [side, 0, 0], "down": [0, -side, 0]}
        found = trace(scene(lens, columns=24, cells=4, picture=picture))
        np.testing.assert_allclose(found.irradiance, expected, rtol=close)
        assert sum(caustic(found).shares.values()) == pytest.approx(1.0, abs=1e-12)


def test_each_cell_behind_a_ball_gets_what_its_closed_form_says() -> None:
    """Pixels of the film reach over several cells: what is even across each of them shows as rings.

    A ray of parallel light at height h meets a unit ball at i = asin h, goes on in it at r = asin(h / n), and leaves it
    turned by 2 (i - r) from the axis; the light within h is within the place to which that goes.
    """
    n, plane, cells, side = 1.5, 1.2, 120, 1.6
    found = trace(
        make_scene(
            {"surface": "sphere", "n": n}, source={"kind": "parallel", "direction": [0.0, 0.0, -1.0]},
            film={"centre": [0.0, 0.0, 2.5], "right": [2.2, 0, 0], "down": [0, -2.2, 0], "size": [41, 41]},
            picture={
                "corner": [-side / 2, side / 2, -plane], "right": [side, 0, 0], "down": [0, -side, 0],
                "size": [cells, cells],
            },
            effects={"caustics": True},
        )
    )  # fmt: skip
    h = np.sqrt(np.linspace(0.0, 1.0, 4_000_001))
    i, r = np.arcsin(h), np.arcsin(h / n)
    place = np.abs(np.sin(2 * r - i) - np.tan(2 * (i - r)) * (plane - np.cos(2 * r - i)))
    rings = np.linspace(0.0, 1.3, 2601)
    gathered = np.histogram(place, rings)[0] / len(h) / np.diff(rings**2)
    fine = ((np.arange(cells * 8) + 0.5) / (cells * 8) - 0.5) * side
    radius = np.hypot(*np.meshgrid(fine, fine))
    expected = np.interp(radius, (rings[1:] + rings[:-1]) / 2, gathered).reshape(cells, 8, cells, 8).mean(axis=(1, 3))
    radius = radius.reshape(cells, 8, cells, 8).mean(axis=(1, 3))
    some = (radius > 0.05) & (radius < 0.75)
    off = np.abs(found.irradiance[some] / expected[some] - 1.0)
    assert some.sum() > 5000
    assert expected[some].max() > 30 * expected[some].min()
    assert np.sqrt((off**2).mean()) < 0.005  # most of it where the light ends in a fold, which the rings do not resolve
    assert np.quantile(off, 0.95) < 0.005
