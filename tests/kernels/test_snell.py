"""Snell's law on vectors, for the kernels of every precision and width and for their twin."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray
from probe import FORMS, Probe

from lenscl import reference

BODY = """
  const real3v d = {in_0, in_1, in_2}, n = {in_3, in_4, in_5};
  maskv total;
  const real3v t = refract(d, n, in_6, &total);
  out_0 = t.x; out_1 = t.y; out_2 = t.z; out_3 = total ? (realv)1 : (realv)0;
"""
Refract = Callable[[Any, Any, Any], tuple[NDArray[np.float64], NDArray[np.bool_]]]


def kernel(precision: str, width: int, rule: str = "exact", total: str = "possible") -> Refract:
    probe = Probe((f"total_{total}.cl", f"snell_{rule}.cl"), BODY, 7, 4, precision, width)

    def refract(d: Any, n: Any, eta: Any) -> tuple[NDArray[np.float64], NDArray[np.bool_]]:
        result = probe(*d.T, *n.T, eta)
        return result[:, :3], result[:, 3] != 0

    return refract


CASES = [pytest.param(reference.refract, 1e-15, id="twin")]
CASES += [pytest.param(kernel(p, w), {"single": 1.2e-7, "double": 2.3e-16}[p], id=f"{p}-{w}") for p, w in FORMS]


def directions(count: int, seed: int) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return random unit rays and unit normals against them, grazing ones included."""
    rng = np.random.default_rng(seed)
    n = rng.normal(size=(count, 3))
    n /= np.linalg.norm(n, axis=1, keepdims=True)
    across = np.cross(n, rng.normal(size=(count, 3)))
    across /= np.linalg.norm(across, axis=1, keepdims=True)
    cosine = rng.uniform(0, 1, size=(count, 1))
    cosine[: count // 2] = 10.0 ** rng.uniform(-5, 0, size=(count // 2, 1))
    sine = np.sqrt(1 - cosine**2)
    steep = slice(3 * count // 4, None)  # what a high index lets out
    sine[steep] = 10.0 ** rng.uniform(-5, 0, size=sine[steep].shape)
    cosine[steep] = np.sqrt(1 - sine[steep] ** 2)
    return across * sine - cosine * n, n


@pytest.mark.parametrize(("refract", "eps"), CASES)
@pytest.mark.parametrize("eta", [0.001, 0.4, 1 / 1.5, 0.999, 1.001, 1.5, 2.4, 30.0, 1000.0])
def test_tangential_momentum_is_kept_or_the_ray_is_totally_reflected(refract: Refract, eps: float, eta: float) -> None:
    d, n = directions(4000, 7)
    t, total = refract(d, n, np.full(len(d), eta))
    sine = eta * np.linalg.norm(np.cross(n, d), axis=1)
    clear = np.abs(sine - 1) > 1e3 * eps  # nearer to the critical angle rounding decides
    clear |= np.abs(sine - 1) > 20 * eps * eta  # the rounding of the ray itself
    assert clear.sum() > 3000
    np.testing.assert_array_equal(total[clear], sine[clear] > 1)
    passed = clear & ~total
    assert passed.sum() > 100
    mismatch = np.abs(np.cross(n, t) - eta * np.cross(n, d))[passed].max()
    assert mismatch < 20 * eps * max(eta, 1), "n1 (N x d) == n2 (N x t), as vectors"
    assert np.abs(np.linalg.norm(t, axis=1) - 1).max() < 20 * eps * max(1, eta)
    assert (np.sum(t * n, axis=1)[passed] <= 4 * eps).all(), "a refracted ray goes to the far side"
    if total.any():
        np.testing.assert_allclose(t[total], d[total], atol=eps)


@pytest.mark.parametrize(("refract", "eps"), CASES[1:])
def test_at_equal_indices_the_direction_is_returned_bit_for_bit(refract: Refract, eps: float) -> None:
    d, n = directions(4000, 8)
    dtype = np.float32 if eps > 1e-10 else np.float64
    d = d.astype(dtype).astype(np.float64)
    t, total = refract(d, n, np.ones(len(d)))
    assert not total.any()
    np.testing.assert_array_equal(t, d)


@pytest.mark.parametrize(("refract", "eps"), CASES[1:])
@given(exponent=st.floats(-12, -3), below=st.booleans())
def test_the_critical_angle_is_resolved_to_rounding(refract: Refract, eps: float, exponent: float, below: bool) -> None:
    sine = 1 / 1.5
    away = (-1 if below else 1) * 10.0**exponent
    angle = np.arcsin(sine) + away
    d = np.array([[np.sin(angle), 0.0, -np.cos(angle)]])
    n = np.array([[0.0, 0.0, 1.0]])
    t, total = refract(d, n, np.array([1.5]))
    if abs(away) > 8 * eps:
        assert total[0] == (away > 0)
    if not total[0]:
        cosine = np.sqrt(max(0.0, 1 - (1.5 * np.sin(angle)) ** 2))
        assert abs(-t[0, 2] - cosine) <= 8 * eps / max(cosine, np.sqrt(eps))  # d sqrt(k) = dk / (2 sqrt(k))


@pytest.mark.parametrize(("precision", "width"), FORMS)
def test_grazing_light_between_equal_indices_has_no_division_by_zero(precision: str, width: int) -> None:
    d, n = np.array([[1.0, 0.0, 0.0]]), np.array([[0.0, 0.0, 1.0]])
    for eta in (1.0, 0.5, 1.5):
        t, total = kernel(precision, width)(d, n, np.array([eta]))
        assert np.isfinite(t).all()
        assert total[0] == (eta > 1)


@pytest.mark.parametrize("precision", ["single", "double"])
def test_where_total_reflection_is_ruled_out_rounding_only_lets_light_graze(precision: str) -> None:
    """Some roundings beyond the critical angle of glass, a ray leaves along the surface, still of unit length."""
    eps = {"single": 1.2e-7, "double": 2.3e-16}[precision]
    sine = (1.0 + eps * np.arange(1.0, 17.0)) / 1.5
    d = np.stack([sine, 0.0 * sine, -np.sqrt(1.0 - sine**2)], axis=1)
    n, eta = np.broadcast_to([0.0, 0.0, 1.0], d.shape), np.full(len(d), 1.5)
    _, would = kernel(precision, 8)(d, n, eta)
    bent, total = kernel(precision, 8, total="impossible")(d, n, eta)
    assert would.sum() > 10
    assert not total.any()
    np.testing.assert_allclose(np.linalg.norm(bent, axis=1), 1.0, atol=100 * eps)
    np.testing.assert_allclose(bent[would], np.broadcast_to([1.0, 0.0, 0.0], bent[would].shape), atol=100 * eps)


@pytest.mark.parametrize(("precision", "width"), FORMS)
def test_the_paraxial_rule_bends_40_degrees_in_glass_to_51_and_never_reflects(precision: str, width: int) -> None:
    refract = kernel(precision, width, "paraxial")
    angle = np.radians([40.0, 80.0])
    d = np.stack([np.sin(angle), np.zeros(2), -np.cos(angle)], axis=1)
    t, total = refract(d, np.tile([0.0, 0.0, 1.0], (2, 1)), np.full(2, 1.458))
    out = np.degrees(np.arctan2(t[:, 0], -t[:, 2]))
    assert out[0] == pytest.approx(np.degrees(np.arctan(1.458 * np.tan(angle[0]))), abs=1e-4)
    assert out[0] == pytest.approx(50.7, abs=0.06)
    assert not total.any()
    exact, _ = kernel(precision, width)(d, np.tile([0.0, 0.0, 1.0], (2, 1)), np.full(2, 1.458))
    assert np.degrees(np.arctan2(exact[0, 0], -exact[0, 2])) == pytest.approx(69.5, abs=0.1)


def test_a_flipped_sign_under_the_root_is_caught() -> None:
    def flipped(d: Any, n: Any, eta: Any) -> tuple[Any, Any]:
        c = -np.sum(d * n, axis=1)
        k = 1 + eta**2 * (1 - c**2)
        return eta[:, None] * d + (eta * c - np.sqrt(k))[:, None] * n, np.zeros(len(d), bool)

    with pytest.raises(AssertionError):
        test_tangential_momentum_is_kept_or_the_ray_is_totally_reflected(flipped, 1e-15, 1.5)


def test_the_directions_cover_all_incidences() -> None:
    d, n = directions(4000, 7)
    decades = Counter(np.floor(np.log10(-np.sum(d * n, axis=1))).astype(int))
    assert all(decades[k] > 200 for k in (-5, -4, -3, -2, -1))
