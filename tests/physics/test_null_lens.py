"""A lens of the medium's own index changes nothing: every surface, source, precision and width."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from probe import plain_device
from scenes import CATALOGUE, forerunner, make_scene
from thinned import thinned

from lenscl import RayStatus, reference, trace
from lenscl.config import Scene

BOUND = {"single": 1e-6, "double": 1e-12, "mixed": 1e-12}


@pytest.fixture
def side(request: pytest.FixtureRequest) -> int:
    """The side of a film, in pixels."""
    return 512 if request.config.getoption("--slow") else 208


def straight(scene: Scene) -> Any:
    """Return where the rays land without any lens, in double precision, by the twin's own film and screen."""
    origin, direction = reference.film_rays(scene)
    return reference.land(origin, direction, scene.picture)


def deviation(scene: Scene, precision: str) -> tuple[float, int]:
    """Return the largest |st - straight| over all pixels and how many rays met the lens."""
    raymap = trace(scene, precision=precision)
    st, status = straight(scene)
    assert (raymap.status.ravel() == status).all(), "every ray goes on to where it went"
    assert (status == RayStatus.PICTURE).all(), "the scene is made so that all rays land"
    return float(np.abs(raymap.st.reshape(-1, 2) - st).max()), int((raymap.events > 0).sum())


@pytest.mark.parametrize("precision", ["single", "double"])
@pytest.mark.parametrize("surface", CATALOGUE)
def test_a_null_lens_is_the_identity_on_all_pixels(surface: str, precision: str, side: int) -> None:
    scene = make_scene(
        {"surface": surface, "rotate": [20.0, 30.0, 40.0], "n": 1.33}, medium=1.33, film={"size": [side, side]}
    )
    worst, met = deviation(scene, precision)
    assert met > side * side // 27
    assert worst <= BOUND[precision]


@pytest.mark.parametrize("precision", ["single", "double"])
@pytest.mark.parametrize("name", ["ellipsoid", "torus", "heart", "bifolia"])
def test_a_null_lens_is_the_identity_on_the_forerunners_scenes(name: str, precision: str, side: int) -> None:
    scene = forerunner(name, side)
    scene = scene.replace({"lens.n": scene.n_medium})
    raymap = trace(scene, precision=precision)
    st, status = straight(scene)
    same = raymap.status.ravel() == status
    assert same.all()
    assert (raymap.events > 0).sum() > side * side // 27
    assert np.abs(raymap.st.reshape(-1, 2) - st).max() <= BOUND[precision]


SHELL = "max(x**2 + y**2 + z**2 - 0.5, 0.2 - x**2 - y**2 - z**2)"  # hollow: four surfaces, two of them within


WIDTHS = ((1, "torus"), (2, SHELL), (4, "torus"), (8, SHELL), (16, "torus"), (16, SHELL))
PRECISIONS = ("single", "double", "mixed")


@pytest.mark.parametrize(
    ("width", "surface", "precision"),
    thinned(
        ((*row, precision) for row in WIDTHS for precision in PRECISIONS),
        [(*row, PRECISIONS[number * 2 % 3]) for number, row in enumerate(WIDTHS)],
    ),
)
def test_every_packet_width_does_the_same(surface: str, width: int, precision: str) -> None:
    lens: dict[str, Any] = {"surface": surface}
    events = 2
    if surface == SHELL:
        lens, events = lens | {"bounds": [[-1.0] * 3, [1.0] * 3]}, 4
    scene = make_scene(lens | {"n": 1.33}, medium=1.33)
    st, _ = straight(scene)
    raymap = trace(scene, precision=precision, device=plain_device(width, width))
    assert (raymap.events == events).sum() > 100
    assert np.abs(raymap.st.reshape(-1, 2) - st).max() <= BOUND[precision]


def test_parallel_light_and_the_paraxial_rule_pass_a_null_lens_too() -> None:
    scene = make_scene(
        {"surface": "ellipsoid", "n": 1.0},
        source={"kind": "parallel", "direction": [0.1, 0.2, -1.0]},
        numerics={"snell": "paraxial"},
    )
    worst, met = deviation(scene, "double")
    assert met > 500
    assert worst <= 1e-12


def test_the_bound_would_catch_an_index_off_by_a_billionth() -> None:
    scene = make_scene({"surface": "sphere", "n": 1.0 + 1e-9})
    worst, _ = deviation(scene, "double")
    assert worst > BOUND["double"]
