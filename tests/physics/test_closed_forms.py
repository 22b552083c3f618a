"""Lenses whose rays are known in closed form."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray
from physics.paths import Paths
from probe import plain_device
from scenes import make_scene
from thinned import thinned

from lenscl import trace, trace_rays
from lenscl.config import Scene
from lenscl.errors import TraceError
from lenscl.reference import film_rays

Array = NDArray[np.floating]
FORMS = [(precision, width) for precision in ("single", "double", "mixed") for width in (1, 4, 8, 16)]
EPSILON = {"single": 2.0**-23, "double": 2.0**-52, "mixed": 2.0**-52}
SOME = [("single", 16), ("single", 1), ("double", 8), ("double", 1), ("mixed", 4)]
every_form = pytest.mark.parametrize(("precision", "width"), thinned(FORMS, SOME))
Wide = np.longdouble  # 64 bits of mantissa here: more than the kernels have


def through_ellipsoid(
    scene: Scene, axes: tuple[float, float, float], origin: Array, direction: Array
) -> tuple[Array, Array]:
    """Return which rays hit an ellipsoid at the world's origin and, for these, where they land after two refractions.

    NaN where the exit reflects totally.

    The quadratic's roots in closed form, Snell's law by angles: no part of this is shared with the program.
    """
    o, d, scale = origin.astype(Wide), direction.astype(Wide), np.array(axes, Wide)
    d = d / np.sqrt((d * d).sum(1, keepdims=True))
    n_lens, n_medium = Wide(scene.lenses[0].n), Wide(scene.n_medium)

    def quadratic(o: Array, d: Array) -> tuple[Array, Array, Array]:
        u, v = o / scale, d / scale
        a, b, c = (v * v).sum(1), (u * v).sum(1), (u * u).sum(1) - 1
        return a, b, b * b - a * c

    def bent(d: Array, normal: Array, ratio: Wide) -> Array:
        cosine = -(d * normal).sum(1)
        sine = np.sqrt(1 - cosine**2)
        across = (d + cosine[:, None] * normal) / np.where(sine == 0, 1, sine)[:, None]
        sine_out = ratio * sine
        with np.errstate(invalid="ignore"):  # a totally reflected ray has no such direction
            return across * sine_out[:, None] - normal * np.sqrt(1 - sine_out**2)[:, None]

    a, b, discriminant = quadratic(o, d)
    hits = discriminant > 0
    o, d, a, b = o[hits], d[hits], a[hits], b[hits]
    p = o + ((-b - np.sqrt(discriminant[hits])) / a)[:, None] * d
    normal = p / scale**2
    normal /= np.sqrt((normal * normal).sum(1, keepdims=True))
    d = bent(d, normal, n_medium / n_lens)
    a, b, discriminant = quadratic(p, d)
    q = p + ((-b + np.sqrt(discriminant)) / a)[:, None] * d
    normal = q / scale**2
    normal /= np.sqrt((normal * normal).sum(1, keepdims=True))
    d = bent(d, -normal, n_lens / n_medium)
    picture = scene.picture
    distance = (picture.corner[2] - q[:, 2]) / d[:, 2]
    land = q + distance[:, None] * d
    st = np.stack(
        [(land[:, 0] - picture.corner[0]) / picture.right[0], (land[:, 1] - picture.corner[1]) / picture.down[1]], 1
    )
    return hits, st


@pytest.mark.parametrize(("precision", "typical", "worst"), [("double", 2e-14, 2e-11), ("single", 2e-6, 5e-3)])
@pytest.mark.parametrize(
    ("lens", "axes"),
    [
        ({"surface": "sphere", "r": 0.9}, (0.9, 0.9, 0.9)),
        ({"surface": "ellipsoid", "a": 1.0, "b": 0.8, "c": 0.6}, (1.0, 0.8, 0.6)),
        ({"surface": "ellipsoid", "r": 0.8, "stretch": [1.2, 1.0, 0.9]}, (0.96, 0.8, 0.72)),
    ],
)
def test_sphere_and_ellipsoid_agree_with_their_closed_form(
    lens: dict[str, object], axes: tuple[float, float, float], precision: str, typical: float, worst: float
) -> None:
    scene = make_scene(lens, film={"size": [200, 200]})
    raymap = trace(scene, precision=precision)
    origin, direction = film_rays(scene)
    hits, st = through_ellipsoid(scene, axes, origin, direction)
    np.testing.assert_array_equal(raymap.events.ravel()[~hits] == 0, True)
    met, lands = raymap.events.ravel()[hits], np.isfinite(st).all(axis=1)
    assert (met[lands] == 2).sum() > 5000
    assert (met == 0).mean() < 0.01, "the march may lose a chord shorter than its step at the silhouette"
    assert set(met[lands].tolist()) <= {0, 2}
    assert (met[~lands] > 2).all()
    same = lands & (met == 2)
    error = np.abs(raymap.st.reshape(-1, 2)[hits][same] - st[same]).max(axis=1)
    assert np.median(error) < typical
    assert error.max() < worst  # at the silhouette, where the exit angle's condition is infinite


def test_a_glass_balls_paraxial_focus_is_where_the_lensmaker_says() -> None:
    n, r = 1.5, 0.8
    ball = make_scene({"surface": "sphere", "r": r, "n": n})
    height = np.array([1e-3, 2e-3, 4e-3])
    rays = trace_rays(ball, np.stack([height, 0 * height, 3 + 0 * height], 1), np.tile([0.0, 0.0, -1.0], (3, 1)))
    crossing = rays.origin[:, 2] - rays.origin[:, 0] * rays.direction[:, 2] / rays.direction[:, 0]
    focus = -n * r / (2 * (n - 1))
    error = np.abs(crossing - focus)
    assert (error < 2 * height**2).all()
    np.testing.assert_allclose(
        error[1:] / error[:-1], 4, rtol=1e-2
    )  # spherical aberration goes with the height squared


def hold_image(scene: Scene, width: int, origins: Array, directions: Array, image: Array) -> None:
    """Hold that behind the first surface rays pass a point, but for what it rounds."""
    paths = Paths.of(scene, plain_device(width, width), origins, directions, 1)
    assert (paths.events == 1).all()
    to_image = image - paths.points[1]
    miss = np.linalg.norm(np.cross(to_image, paths.directions[1]), axis=1)
    distance = np.linalg.norm(to_image, axis=1)
    slack = paths.slack_of(paths.hits.turn.min(axis=1))
    bound = distance * slack + 2.0 * paths.hits.place
    assert (bound < 1e5 * paths.eps * (1.0 + distance)).all()
    assert (miss <= bound).all(), (miss.max(), bound)


@every_form
@pytest.mark.parametrize("n", [1.3, 1.5, 2.4])
def test_an_ellipsoid_of_eccentricity_1_over_n_brings_parallel_light_to_its_far_focus(
    n: float, precision: str, width: int
) -> None:
    major = 1.0
    minor = major * np.sqrt(1 - 1 / n**2)
    lens = {"surface": "ellipsoid", "a": minor, "b": minor, "c": major, "n": n}
    height = np.linspace(-0.95, 0.95, 41) * minor
    start = np.stack([0.6 * height, 0.8 * height, 3 + 0 * height], 1)
    along = np.tile([0.0, 0.0, -1.0], (41, 1))
    focus = np.array([0.0, 0.0, -major / n])
    scene = make_scene(lens, numerics={"precision": precision})
    hold_image(scene, width, start, along, focus)
    with pytest.raises(AssertionError):
        hold_image(scene.replace({"lens.n": n * (1 + 1e6 * EPSILON[precision])}), width, start, along, focus)


@every_form
def test_a_sphere_is_aplanatic_at_radius_over_n(precision: str, width: int) -> None:
    n, r = 1.5, 1.0
    ball = make_scene({"surface": "sphere", "r": r, "n": n}, numerics={"precision": precision})
    angle = np.linspace(-1.4, 1.4, 29)
    start = np.tile([0.0, 0.0, r / n], (29, 1))  # inside the glass; images at n r on the same side
    along = np.stack([np.sin(angle), 0 * angle, -np.cos(angle)], 1)
    hold_image(ball, width, start, along, np.array([0.0, 0.0, r * n]))


OVAL = "sqrt(x**2 + y**2 + (z - p)**2) + g*sqrt(x**2 + y**2 + (z + q)**2) - c"  # the optical path by way of a point
OBJECT, IMAGE = 3.0, 0.4


@pytest.mark.parametrize(("precision", "width"), thinned(FORMS[::2], [("single", 1), ("double", 8), ("mixed", 8)]))
@pytest.mark.parametrize("n", [1.5, 1.9])
def test_a_cartesian_oval_images_a_point_to_a_point(n: float, precision: str, width: int) -> None:
    """The solid within which the path from (0, 0, p), by way of any of its points, to (0, 0, -q) is shorter than c."""
    path = OBJECT - 0.6 + n * (0.6 + IMAGE)  # by way of the vertex, (0, 0, 0.6)
    lens = {"surface": OVAL, "p": OBJECT, "q": IMAGE, "g": n, "c": path, "n": n, "bounds": [[-2, -2, -2.5], [2, 2, 1]]}
    angle, turn = np.linspace(-0.12, 0.12, 33), 0.7
    sine = np.sin(angle)
    along = np.stack([sine * np.cos(turn), sine * np.sin(turn), -np.cos(angle)], 1)
    start = np.tile([0.0, 0.0, OBJECT], (33, 1))
    scene = make_scene(lens, numerics={"precision": precision})
    hold_image(scene, width, start, along, np.array([0.0, 0.0, -IMAGE]))
    with pytest.raises(AssertionError):  # the oval of another index
        hold_image(scene.replace({"lens.n": n + 1e-2}), width, start, along, np.array([0.0, 0.0, -IMAGE]))


@pytest.mark.parametrize("precision", ["single", "double"])
def test_an_index_of_a_thousand_costs_three_digits_and_no_more(precision: str) -> None:
    ball = make_scene({"surface": "sphere", "r": 1.0, "n": 1000.0}, numerics={"precision": precision})
    rng = np.random.default_rng(0)
    p = rng.normal(size=(2000, 3))
    p /= np.linalg.norm(p, axis=1, keepdims=True)
    across = np.cross(p, rng.normal(size=p.shape))
    across /= np.linalg.norm(across, axis=1, keepdims=True)
    sine = rng.uniform(0, 0.999, (2000, 1))  # of the angle outside
    rays = trace_rays(ball, across * sine / 1000, p)
    assert (rays.events == 1).all(), "none is beyond the critical angle"
    eps = {"single": 2.0**-23, "double": 2.0**-52}[precision]
    assert np.abs(np.linalg.norm(rays.direction.astype(float), axis=1) - 1).max() < 8000 * eps
    cosine = np.sum(rays.direction * rays.origin, axis=1)
    assert np.abs(cosine - np.sqrt(1 - sine[:, 0] ** 2)).max() < 4000 * eps / np.sqrt(1 - 0.999**2)


def test_origins_that_no_number_of_single_precision_holds_are_refused() -> None:
    ball = make_scene({"surface": "sphere"})
    with pytest.raises(TraceError, match=r"origins\[1\]: expected numbers of a size up to 1e\+30"):
        trace_rays(ball, [[0, 0, 4], [1e39, 0, 0]], [[0, 0, -1], [-1, 0, 0]])
    for precision in ("single", "double"):
        far = trace_rays(ball.replace({"numerics.precision": precision}), [[1e30, 0, 0]], [[-1, 0, 0]])
        assert np.isfinite(far.origin).all()


def test_a_wrong_focal_length_would_be_seen() -> None:
    ball = make_scene({"surface": "sphere", "r": 0.8, "n": 1.5001})
    rays = trace_rays(ball, np.array([[1e-3, 0.0, 3.0]]), np.array([[0.0, 0.0, -1.0]]))
    crossing = rays.origin[:, 2] - rays.origin[:, 0] * rays.direction[:, 2] / rays.direction[:, 0]
    assert abs(crossing[0] + 1.5 * 0.8 / (2 * 0.5)) > 2e-6
