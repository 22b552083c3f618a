"""Fresnel's law: closed forms, energy, and fields that are carried along whole paths by hand."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from faults_in_kernels import Fault, broken
from numpy.typing import NDArray
from probe import plain_device
from scenes import make_scene

from lenscl import RayStatus, trace, trace_rays

Array = NDArray[Any]
POLARISED = "effects/fresnel_polarised.cl"
SLAB = {"surface": "max(abs(z) - 0.5, max(abs(x), abs(y)) - 8)", "bounds": [[-9, -9, -1], [9, 9, 1]]}
EGGS = (  # planes of incidence differ from surface to surface, and light that was totally reflected gets out
    {"surface": "sphere", "name": "first", "r": 0.9, "centre": [0.0, 0.0, 0.8], "n": 1.7, "stretch": [1.0, 0.6, 0.8]},
    {
        "surface": "sphere",
        "name": "second",
        "r": 0.8,
        "centre": [0.3, -0.2, -0.95],
        "n": 1.5,
        "stretch": [0.7, 1.2, 1.0],
    },
)


def first_surface(angle: Array, n_before: float, n_after: float, **effects: Any) -> Any:
    """Return what is behind the upper face of a slab, at angles of incidence in radians."""
    scene = make_scene(
        SLAB | {"n": n_after}, medium=n_before, effects={"total_reflection": "follow", **effects},
        numerics={"max_events": 1},
    )  # fmt: skip
    d = np.stack([np.sin(angle), 0 * angle, -np.cos(angle)], axis=1)
    rays = trace_rays(scene, np.array([0.0, 0.0, 0.5]) - 0.5 * d, d)
    assert (rays.events == 1).all()
    return rays


def powers(angle: Array, n_before: float, n_after: float) -> tuple[Array, Array]:
    """Return the reflected power of s and p by the laws of sine and tangent, of angles that are not 0."""
    behind = np.arcsin(n_before / n_after * np.sin(angle))
    s = (np.sin(angle - behind) / np.sin(angle + behind)) ** 2
    p = (np.tan(angle - behind) / np.tan(angle + behind)) ** 2
    return s, p


@pytest.mark.parametrize("kind", [True, "polarised"])
@pytest.mark.parametrize(("n_before", "n_after"), [(1.0, 1.5), (1.0, 2.417), (1.5, 1.33), (1.33, 1.000277)])
def test_a_surface_reflects_by_the_laws_of_sine_and_tangent(n_before: float, n_after: float, kind: Any) -> None:
    critical = np.arcsin(min(n_after / n_before, 1.0))
    angle = np.linspace(0.01, 0.999, 60) * critical
    s, p = powers(angle, n_before, n_after)
    found = first_surface(angle, n_before, n_after, fresnel=kind)
    np.testing.assert_allclose(found.transmittance, 1.0 - (s + p) / 2, rtol=0, atol=2e-14)


@pytest.mark.parametrize("n", [1.33, 1.5, 2.417])
def test_at_brewsters_angle_only_s_is_reflected(n: float) -> None:
    found = first_surface(np.arctan([n]), 1.0, n, fresnel=True)
    assert found.transmittance[0] == pytest.approx(1.0 - ((n**2 - 1) / (n**2 + 1)) ** 2 / 2, abs=1e-14)


def test_straight_through_a_slab_both_faces_take_their_share() -> None:
    for kind in (True, "polarised"):
        rays = trace_rays(make_scene(SLAB, effects={"fresnel": kind}), [[0.0, 0.0, 3.0]], [[0.0, 0.0, -1.0]])
        assert rays.events[0] == 2
        assert rays.transmittance[0] == pytest.approx(0.96**2, abs=1e-15)


def test_tilted_plates_polarise_what_the_next_one_meets() -> None:
    """A pile of plates at Brewster's angle lets p pass whole and s less and less; unpolarised anew, less passes."""
    n, faces = 1.5, 8
    plates = [
        {**SLAB, "name": f"plate{i}", "stretch": [1.0, 1.0, 0.1], "centre": [0.0, 0.0, -0.3 * i], "n": n}
        for i in range(faces // 2)
    ]
    angle = np.arctan(n)
    d = np.array([[np.sin(angle), 0.0, -np.cos(angle)]])
    s = powers(np.array([angle]), 1.0, n)[0][0]
    found = {
        kind: trace_rays(make_scene(*plates, effects={"fresnel": kind}), -d, d).transmittance[0]
        for kind in (True, "polarised")
    }
    assert found[True] == pytest.approx((1.0 - s / 2) ** faces, abs=1e-14)
    assert found["polarised"] == pytest.approx((1.0 + (1.0 - s) ** faces) / 2, abs=1e-14)


@pytest.mark.parametrize("precision", ["single", "double"])
def test_polarised_light_is_that_of_fields_carried_by_hand(precision: str) -> None:
    """Two fields across each other, complex vectors in space, go by Fresnel's amplitudes from surface to surface."""
    random = np.random.default_rng(3)
    # From within many are totally reflected
    within, outside = random.uniform(-0.5, 0.5, (600, 3)), random.uniform(-0.6, 0.6, (100, 3))
    start = np.concatenate([within * [1, 1, 0.6] + [0, 0, 0.8], outside * [1, 1, 0] + [0, 0, 2.5]])
    d = np.concatenate([random.normal(size=within.shape), outside[::-1] * [0.3, 0.3, 0] - [0, 0, 1]])
    d /= np.linalg.norm(d, axis=1, keepdims=True)
    asked = {"fresnel": "polarised", "total_reflection": "follow"}
    scene = make_scene(*EGGS, effects=asked, numerics={"precision": precision, "max_events": 12})
    ends = trace_rays(scene, start, d)
    power, most, reflected = by_hand(scene, start, d, ends.events)
    assert most == 12
    # Not the same as light that is unpolarised at every surface
    plain = trace_rays(scene.replace({"effects.fresnel": True}), start, d)
    assert np.abs(plain.transmittance - ends.transmittance).max() > 0.01
    leaves = ends.status != RayStatus.TRAPPED
    assert leaves.sum() > 400
    assert (leaves & (reflected >= 1)).sum() > 100
    assert (leaves & (reflected >= 2)).sum() > 20
    off = np.abs(power - ends.transmittance)[leaves]
    assert off.max() < (2e-5 if precision == "single" else 1e-12)


def by_hand(scene: Any, start: Array, d: Array, events: Array) -> tuple[Array, int, Array]:
    """Return the power of unpolarised light at the ends of rays, the most surfaces met, each ray's reflections."""
    first = np.cross(d, [0.3, 0.5, 0.8])
    first /= np.linalg.norm(first, axis=1, keepdims=True)
    fields = [first.astype(complex), np.cross(d, first).astype(complex)]
    exact = scene.replace({"numerics.precision": "double", "effects.fresnel": False})
    before, total = d, np.zeros(len(d), int)
    for k in range(1, int(events.max()) + 1):
        at = trace_rays(exact.replace({"numerics.max_events": k}), start, d)
        met = at.events == k
        local = [(at.origin - lens.centre) / lens.stretch for lens in exact.lenses]
        radii = [lens.values["r"] for lens in exact.lenses]
        egg = np.argmin([abs(np.linalg.norm(p, axis=1) - r) for p, r in zip(local, radii, strict=True)], axis=0)
        centre, stretch, index = (
            np.array([getattr(lens, name) for lens in exact.lenses])[egg] for name in ("centre", "stretch", "n")
        )
        outward = (at.origin - centre) / stretch**2
        outward /= np.linalg.norm(outward, axis=1, keepdims=True)
        leaves = (before * outward).sum(axis=1) > 0
        normal = np.where(leaves[:, None], -outward, outward)
        n1, n2 = np.where(leaves, index, 1.0), np.where(leaves, 1.0, index)
        cos1 = -(before * normal).sum(axis=1)
        sin2 = n1 / n2 * np.sqrt(1.0 - np.minimum(cos1, 1.0) ** 2)
        cos2 = np.emath.sqrt(1.0 - sin2.astype(complex) ** 2)
        reflected = sin2 > 1.0
        total += reflected & met
        s = np.cross(before, normal)
        s /= np.linalg.norm(s, axis=1, keepdims=True)
        p, p_behind = np.cross(before, s), np.cross(at.direction, s)
        # Amplitudes; what passes is scaled so that its square is power. Of total reflection: the phases alone
        scale = np.sqrt(np.where(reflected, 1.0, (n2 * cos2 / (n1 * cos1)).real))
        t_s, t_p = 2 * n1 * cos1 / (n1 * cos1 + n2 * cos2), 2 * n1 * cos1 / (n2 * cos1 + n1 * cos2)
        # sqrt of a negative number is +i |.| here, as for fields that go as exp(-i w t) and fade behind the surface
        r_s = (n1 * cos1 - n2 * cos2) / (n1 * cos1 + n2 * cos2)
        r_p = (n2 * cos1 - n1 * cos2) / (n2 * cos1 + n1 * cos2)
        a_s, a_p = np.where(reflected, r_s, t_s * scale), np.where(reflected, r_p, t_p * scale)
        for i, field in enumerate(fields):
            e_s, e_p = (field * s).sum(axis=1), (field * p).sum(axis=1)
            behind = (a_s * e_s)[:, None] * s + (a_p * e_p)[:, None] * p_behind
            fields[i] = np.where(met[:, None], behind, field)
        before = np.where(met[:, None], at.direction, before)
    return sum((np.abs(field) ** 2).sum(axis=1) for field in fields) / 2, int(events.max()), total


def test_an_effect_that_observes_leaves_every_place_as_it_is() -> None:
    scene = make_scene({"surface": "torus"}, film={"size": [64, 64]})
    bare = trace(scene)
    for kind in (True, "polarised"):
        seen = trace(scene.replace({"effects.fresnel": kind}))
        np.testing.assert_array_equal(seen.st, bare.st)
        np.testing.assert_array_equal(seen.status, bare.status)
        assert seen.transmittance.shape == bare.status.shape
        assert ((seen.transmittance >= 0.0) & (seen.transmittance <= 1.0)).all()
        assert (seen.transmittance[seen.events == 0] == 1.0).all()
        assert (seen.transmittance[seen.events > 0] < 0.97).all()


WEDGE = {"surface": "max(max(x + 2*z, -0.5 - z), max(abs(x), abs(y)) - 1.5)", "bounds": [[-2, -2, -1], [2, 2, 2]]}
ASKEW = {"surface": "max(max(0.6*y + 0.8*z, -1.5 - z), max(abs(x), abs(y)) - 1.5)", "bounds": [[-2, -2, -2], [2, 2, 2]]}


def shares(cos_i: float, n_before: float, n_after: float) -> Array:
    """Return the refracted power of s and of p by Fresnel's amplitudes (Born & Wolf, sec. 1.5.2)."""
    cos_t = np.sqrt(1 - (n_before / n_after) ** 2 * (1 - cos_i**2))
    s = (n_before * cos_i - n_after * cos_t) / (n_before * cos_i + n_after * cos_t)
    p = (n_after * cos_i - n_before * cos_t) / (n_after * cos_i + n_before * cos_t)
    return 1 - np.array([s, p]) ** 2


def straight_on_between() -> tuple[Array, float]:
    """Return transmittances of rays through an oblique face, one that they meet straight on, and an oblique one.

    And the one that they should have. The last plane of incidence is at a right angle to the first.
    """
    n = 2.0
    scene = make_scene(
        WEDGE | {"n": n, "name": "wedge", "centre": [0.0, 0.0, 1.0]},
        ASKEW | {"n": n, "name": "askew", "centre": [0.0, 0.0, -2.0]},
        effects={"fresnel": "polarised"}, numerics={"max_events": 3},
    )  # fmt: skip
    # Behind the first face, of normal (1, 0, 2), rays go down, and some of them straight down to the last bit: that
    # happens as products by 1 / 2, the ratio of indices, and by 1 are exact
    sin_i = n / np.sqrt(5.0)
    tilt = np.arcsin(sin_i) - np.arcsin(1.0 / np.sqrt(5.0))
    x = np.sin(tilt) + np.arange(-500, 500) * 2.0**-54
    d = np.stack([x, 0 * x, -np.sqrt(1 - x * x)], axis=1)
    at = np.array([0.0, 0.0, 1.0]) - 0.5 * d
    first = trace_rays(scene.replace({"numerics.max_events": 1}), at, d, device=plain_device())
    straight = (first.direction[:, :2] == 0).all(axis=1)
    assert straight.any()
    found = trace_rays(scene, at[straight], d[straight], device=plain_device())
    assert (found.events == 3).all()
    before, between, behind = shares(np.sqrt(1 - sin_i**2), 1.0, n), shares(1.0, n, 1.0), shares(0.8, 1.0, n)
    return found.transmittance, float(0.5 * between[0] * (before * behind[::-1]).sum())


def test_a_surface_met_straight_on_keeps_what_is_polarised() -> None:
    found, true = straight_on_between()
    np.testing.assert_allclose(found, true, rtol=1e-14)


@pytest.mark.parametrize(
    "fault",
    [
        Fault("polarisation lost", POLARISED, "w * w) * inverse : (realv)1", "w * w) * inverse : (realv)0"),
        Fault("axes lost", POLARISED, "turns ? scale * s.y : old.y", "turns ? scale * s.y : (realv)0"),
    ],
    ids=lambda fault: fault.name,
)
def test_a_surface_met_straight_on_that_loses_something_is_seen(fault: Fault) -> None:
    with broken(fault):
        found, true = straight_on_between()
    assert (np.abs(found - true) > 1e-3).all()


def test_light_without_axes_may_have_any() -> None:
    """As it starts there is nothing to turn from: what would be divided is 0 by 0."""
    found = first_surface(np.array([0.3]), 1.0, 1.5, fresnel="polarised")
    assert np.isfinite(found.transmittance).all()
    with broken(Fault("turned from nowhere", POLARISED, "known = turns & (square > (realv)0)", "known = turns")):
        found = first_surface(np.array([0.3]), 1.0, 1.5, fresnel="polarised")
    assert np.isnan(found.transmittance).all()
