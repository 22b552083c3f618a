"""What the front of a lens reflects: how much, whereto, and what is seen of it."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from scenes import make_scene

from lenscl import RayStatus, paint, scene_from_toml, trace, trace_rays
from lenscl.config import Scene, study_from_toml
from lenscl.errors import ImageError, StudyError
from lenscl.imaging import write_image
from lenscl.imaging.environment import Panorama
from lenscl.tracing import film_rays

Array = NDArray[np.float64]
BALL: dict[str, Any] = {"surface": "sphere", "r": 1.0}
PICTURE = np.random.default_rng(3).random((7, 9, 3)).astype(np.float32)


def split(lens: dict[str, Any], environment: Any = "picture", **more: Any) -> Scene:
    effects = {"fresnel": "split", "environment": environment, **more.pop("effects", {})}
    return make_scene(lens, effects=effects, **more)


def met(scene: Scene, r: float) -> tuple[Array, Array, Array, NDArray[np.bool_]]:
    """Return where a film's rays meet a ball at the origin first, their directions, the cosines, and which do."""
    origins, ahead = film_rays(scene, np.arange(scene.film.rows * scene.film.columns))
    d = ahead / np.linalg.norm(ahead, axis=1, keepdims=True)
    b = (origins * d).sum(axis=1)
    square = b * b - (origins * origins).sum(axis=1) + r * r
    is_met = square > 0
    point = origins - (b + np.sqrt(np.where(is_met, square, 1.0)))[:, None] * d
    return point, d, -(point * d).sum(axis=1) / r, is_met


def reflected_power(cosine: Array, before: float, behind: float) -> Array:
    """Return (Rs + Rp) / 2 by Fresnel's equations of amplitudes; NaN where all is reflected."""
    with np.errstate(invalid="ignore"):
        other = np.sqrt(1 - (before / behind) ** 2 * (1 - cosine**2))
    s = (before * cosine - behind * other) / (before * cosine + behind * other)
    p = (behind * cosine - before * other) / (behind * cosine + before * other)
    return np.asarray((s**2 + p**2) / 2)


@pytest.mark.parametrize(("precision", "near"), [("single", 2e-4), ("double", 1e-12)])
@pytest.mark.parametrize(("n", "medium"), [(1.5, 1.0), (2.417, 1.333), (1.0, 1.5)])
def test_the_front_of_a_ball_reflects_by_fresnel_and_the_law_of_reflection(
    n: float, medium: float, precision: str, near: float
) -> None:
    scene = split({**BALL, "n": n}, medium=medium, film={"size": [40, 40]}, numerics={"precision": precision})
    upwards = scene.replace(
        {"picture.corner": [-9.0, 9.0, 5.0], "picture.right": [18, 0, 0], "picture.down": [0, -18, 0]}
    )
    raymap, away = trace(upwards), trace(upwards.replace({"effects.environment": "panorama.png"}))
    point, d, cosine, is_met = met(scene, 1.0)
    power = reflected_power(cosine, medium, n)
    fronts = is_met & np.isfinite(power) & (cosine > 0.02)
    assert fronts.sum() > 150
    found = raymap.reflectance.ravel()
    np.testing.assert_allclose(found[fronts], power[fronts], atol=near)
    assert (found[~is_met] == 0).all()
    assert (
        found[is_met & np.isnan(power) & (cosine > 0.02)] == 0
    ).all()  # totally reflected: the ray itself goes there
    r = d - 2 * (d * point).sum(axis=1, keepdims=True) * point
    np.testing.assert_allclose(away.reflected.reshape(-1, 3)[fronts], r[fronts], atol=20 * near)
    assert (away.reflected.reshape(-1, 3)[~is_met] == 0).all()
    ahead = fronts & (r[:, 2] > 0.05)
    place = point + ((5.0 - point[:, 2]) / np.where(ahead, r[:, 2], 1.0))[:, None] * r
    st = np.stack([(place[:, 0] + 9) / 18, (9 - place[:, 1]) / 18], axis=1)
    assert ahead.sum() > 100
    np.testing.assert_allclose(raymap.reflected_st.reshape(-1, 2)[ahead], st[ahead], atol=2e3 * near, rtol=2e3 * near)
    assert (raymap.reflected_st.reshape(-1, 2)[fronts & (r[:, 2] < 0)] == -1).all()


def test_what_a_first_surface_does_not_reflect_it_refracts() -> None:
    """The energy of the split closes; a ball's exit lets through what its entry does."""
    raymap = trace(split({**BALL, "n": 1.7}, film={"size": [60, 60]}))
    through = (raymap.events == 2) & (raymap.status != RayStatus.TOTAL_REFLECTION)
    kept = np.sqrt(raymap.transmittance[through])  # twice the same share: light is unpolarised again, angles the same
    np.testing.assert_allclose(kept + raymap.reflectance[through], 1.0, atol=1e-12)
    assert through.sum() > 500


def test_there_is_no_front_within_glass_nor_on_what_is_opaque() -> None:
    origin, ahead = np.array([[0.0, 0.0, 0.1], [0.0, 0.0, 4.0]]), np.array([[0.1, 0.0, -1.0], [0.01, 0.0, -1.0]])
    assert (trace_rays(split(BALL), origin, ahead).reflectance > 0).tolist() == [False, True]
    stop = trace(split({**BALL, "absorbs": True}))
    assert (stop.status == RayStatus.BLOCKED).sum() > 200
    assert (stop.reflectance == 0).all()


def test_only_what_the_environment_calls_for_is_in_the_kernel() -> None:
    for environment, names in (
        ([0.5], set()),
        ("picture", {"reflected_st"}),
        ("sky.png", {"reflected"}),
    ):
        raymap = trace(split(BALL, environment, film={"size": [8, 8]}))
        assert raymap.added.keys() == {"transmittance", "reflectance", *names}
        assert ("reflected_place" in raymap.kernel.text) == (environment == "picture")
        assert ("reflected_away" in raymap.kernel.text) == (environment == "sky.png")
    plain = trace(make_scene(BALL, effects={"fresnel": True}, film={"size": [8, 8]}))
    np.testing.assert_array_equal(plain.st, raymap.st)
    np.testing.assert_array_equal(plain.transmittance, raymap.transmittance)


@pytest.mark.parametrize("colour", [[0.25], [0.1, 0.5, 0.9]])
def test_a_colour_is_added_by_the_share_that_is_reflected(colour: list[float]) -> None:
    scene = split(BALL, colour, film={"size": [30, 30]})
    raymap, plain = trace(scene), trace(scene.replace({"effects.fresnel": True}))
    seen, through = paint(raymap, PICTURE), paint(plain, PICTURE)
    np.testing.assert_allclose(seen - through, raymap.reflectance[..., None] * np.broadcast_to(colour, 3), atol=1e-6)
    assert (raymap.reflectance > 0.04).sum() > 100
    codes = np.full((4, 4, 3), 128, np.uint8)
    assert (paint(raymap, codes) >= paint(plain, codes)).all()
    grey = paint(raymap, PICTURE[..., :1]) - paint(plain, PICTURE[..., :1])
    weights = np.array([0.2126, 0.7152, 0.0722]) if len(colour) == 3 else np.array([1.0])
    np.testing.assert_allclose(grey[..., 0], raymap.reflectance * (np.array(colour) @ weights), atol=1e-6)


def test_the_picture_is_seen_where_its_reflection_lands_and_the_outside_beside_it() -> None:
    scene = split(BALL, film={"size": [40, 40]}).replace({"picture.corner": [-4.0, 4.0, 5.0]})
    scene = scene.replace({"picture.right": [8, 0, 0], "picture.down": [0, -8, 0]})
    raymap, plain = trace(scene), trace(scene.replace({"effects.fresnel": True}))
    how: dict[str, Any] = {"filter": "nearest", "outside": [0.2, 0.3, 0.4]}
    extra = paint(raymap, PICTURE, **how) - paint(plain, PICTURE, **how)
    s, t = np.moveaxis(raymap.reflected_st, -1, 0)
    is_on = (s >= 0) & (s < 1) & (t >= 0) & (t < 1)
    rows, columns = (np.clip((each * size).astype(int), 0, size - 1) for each, size in ((t, 7), (s, 9)))
    seen = np.where(is_on[..., None], PICTURE[rows, columns], how["outside"])
    np.testing.assert_allclose(extra, raymap.reflectance[..., None] * seen, atol=1e-6)
    assert 20 < (is_on & (raymap.reflectance > 0)).sum() < (raymap.reflectance > 0).sum()


def test_a_panorama_is_turned_as_is_said_and_mixed_between_its_samples(tmp_path: Path) -> None:
    """An image whose colours are straight functions of the angles, so that mixing is exact but at its seam."""
    width, height = 64, 32
    s, t = (np.arange(width) + 0.5) / width, (np.arange(height) + 0.5) / height
    image = np.stack(np.broadcast_arrays(s, t[:, None], 0.5), axis=-1).astype(np.float32)
    write_image(tmp_path / "sky.exr", image)
    scene = split(BALL, str(tmp_path / "sky.exr"), film={"size": [40, 40]})
    raymap, plain = trace(scene), trace(scene.replace({"effects.fresnel": True}))
    extra = paint(raymap, PICTURE) - paint(plain, PICTURE)
    x, y, z = np.moveaxis(raymap.reflected, -1, 0)
    fronts = (raymap.reflectance > 0) & (np.abs(np.arctan2(y, x)) < 3.0) & (np.abs(z) < 0.99)
    assert fronts.sum() > 200
    angle = 0.5 - np.arctan2(y, x) / (2 * np.pi)  # 0 behind, coming round by +y; the middle towards +x
    seen = np.stack([angle, np.arccos(np.clip(z, -1, 1)) / np.pi, 0 * z + 0.5], axis=-1)
    np.testing.assert_allclose(extra[fronts], (raymap.reflectance[..., None] * seen)[fronts], atol=2e-5)


def test_a_panorama_is_taken_as_its_file_says(tmp_path: Path) -> None:
    """An EXR that states that it is encoded is decoded, as a picture is."""
    painted = []
    for encoding in ("linear", "srgb"):
        path = tmp_path / f"{encoding}.exr"
        write_image(path, np.full((2, 4, 3), 0.5, np.float32), metadata={}, encoding=encoding)
        scene = split(BALL, str(path), film={"size": [4, 4], "scale": 0.2})
        painted.append(paint(trace(scene), np.zeros((2, 2, 3), np.float32)))
    np.testing.assert_allclose(painted[1], painted[0] / 0.5 * ((0.5 + 0.055) / 1.055) ** 2.4, rtol=1e-5)
    assert (painted[0] > 0.01).all()


def test_a_panorama_is_mixed_over_its_seam_and_nothing_spreads_that_is_not_mixed_in() -> None:
    light = np.zeros((4, 8, 1))
    light[:, 0], light[:, 7], light[2, 3] = 1.0, 0.5, np.nan
    around = Panorama(light)
    behind = [-1.0, 0.0, 0.0]  # the seam, half way between the last column and the first
    assert around.towards(np.array([behind]))[0, 0] == pytest.approx(0.75)
    assert around.towards(np.array([[-1.0, -1e-12, 0.0]]))[0, 0] == pytest.approx(0.75)  # from its other side
    light[3] = np.nan
    ways = np.array([[0.0, 0.0, 1.0], [-1.0, 1e-9, 0.9], [0.0, 0.0, -1.0]])
    assert np.isfinite(around.towards(ways)[:, 0]).tolist() == [True, True, False]
    row, column = 1, 3  # the place of a sample is its own alone
    height, turn = (row + 0.5) / 4 * np.pi, (0.5 - (column + 0.5) / 8) * 2 * np.pi
    exact = np.array([[np.sin(height) * np.cos(turn), np.sin(height) * np.sin(turn), np.cos(height)]])
    light[row, column] = 0.25
    assert around.towards(exact)[0, 0] == pytest.approx(0.25, abs=1e-12)


def test_an_environment_of_colours_is_luminance_for_a_grey_picture_and_loses_its_alpha(tmp_path: Path) -> None:
    colour = np.array([0.9, 0.5, 0.1])
    luminance = colour @ [0.2126, 0.7152, 0.0722]
    write_image(tmp_path / "rgba.exr", np.broadcast_to([*colour, 1.0], (2, 4, 4)).astype(np.float32))
    write_image(tmp_path / "grey.png", np.broadcast_to(np.array([255, 255], np.uint8), (2, 4, 2)))
    grey = trace(split(BALL, str(tmp_path / "grey.png"), film={"size": [4, 4], "scale": 0.2}))
    painted = paint(grey, np.zeros((3, 3, 3), np.float32))
    np.testing.assert_allclose(painted, np.broadcast_to(grey.reflectance[..., None], painted.shape), rtol=1e-5)
    black = {channels: np.zeros((3, 3, channels), np.float32) for channels in (1, 3)}
    for environment in (colour.tolist(), str(tmp_path / "rgba.exr")):
        raymap = trace(split(BALL, environment, film={"size": [4, 4], "scale": 0.2}))
        share = raymap.reflectance[..., None]
        np.testing.assert_allclose(paint(raymap, black[1]), share * luminance, rtol=1e-5)
        np.testing.assert_allclose(paint(raymap, black[3]), share * colour, rtol=1e-5)


def test_a_colour_is_decoded_as_the_picture_is() -> None:
    raymap = trace(split(BALL, [0.5, 0.5, 0.5], film={"size": [4, 4], "scale": 0.2}))
    painted = paint(raymap, np.zeros((2, 2, 3), np.uint16))  # sRGB, as integers are
    light = raymap.reflectance[..., None] * ((0.5 + 0.055) / 1.055) ** 2.4
    codes = np.where(light <= 0.0031308, 12.92 * light, 1.055 * light ** (1 / 2.4) - 0.055) * 65535
    np.testing.assert_allclose(painted, np.broadcast_to(codes, painted.shape), atol=2)


def test_an_image_that_has_changed_is_read_again(tmp_path: Path) -> None:
    seen = []
    for value in (0.25, 0.5):
        write_image(tmp_path / "sky.exr", np.full((2, 4 if value == 0.25 else 6, 3), value, np.float32))
        raymap = trace(split(BALL, str(tmp_path / "sky.exr"), film={"size": [4, 4], "scale": 0.2}))
        seen.append(paint(raymap, np.zeros((2, 2, 3), np.float32)))
    np.testing.assert_allclose(seen[1], 2 * seen[0], rtol=1e-6)


@pytest.mark.parametrize("precision", ["single", "double"])
def test_no_share_is_below_0(precision: str) -> None:
    raymap = trace(split({**BALL, "n": 1.00001}, numerics={"precision": precision}))
    assert raymap.reflectance.min() == 0.0


@pytest.mark.parametrize("environment", ["picture", "around.png"])
def test_nothing_is_reflected_off_what_is_opaque_or_reflects_totally(environment: str) -> None:
    """Not only is the share 0: there is no place, and no direction."""
    for lens, medium, status in (
        (BALL | {"absorbs": True}, 1.0, RayStatus.BLOCKED),
        (BALL | {"n": 1.0}, 1.5, RayStatus.TOTAL_REFLECTION),
    ):
        raymap = trace(split(lens, environment, medium=medium, effects={"total_reflection": "end"}))
        ended = raymap.status == status
        assert ended.sum() > 50
        follows = trace(raymap.scene.replace({"effects.total_reflection": "follow"}))
        for each in (raymap, follows):
            gone = each.reflected_st[ended] if environment == "picture" else each.reflected[ended]
            assert (gone == (-1.0 if environment == "picture" else 0.0)).all()


def test_samples_of_a_pixel_reflect_each_for_itself() -> None:
    how: dict[str, Any] = {"film": {"size": [20, 20]}}
    raymap = trace(split(BALL, [0.7], effects={"antialias": 3}, **how))
    fine = paint(trace(split(BALL, [0.7], film={"size": [60, 60]})), PICTURE)
    expected = fine.reshape(20, 3, 20, 3, 3).mean(axis=(1, 3))
    np.testing.assert_allclose(paint(raymap, PICTURE), expected, atol=2e-6)


@pytest.mark.parametrize("value", ['""', "true", "-0.5", "[0.1, 0.2]", "[0.1, -0.2, 0.3]", "[nan]", "{ a = 1 }"])
def test_what_is_no_environment_is_refused(value: str) -> None:
    text = make_scene(BALL).to_toml().replace("[effects]", f"[effects]\nenvironment = {value}")
    with pytest.raises(
        StudyError, match=r'^effects\.environment: must be "picture", the path of an image, or a colour'
    ):
        scene_from_toml(text)


def test_an_image_is_sought_beside_the_study_and_named_where_it_is_missing(tmp_path: Path) -> None:
    text = make_scene(BALL, effects={"fresnel": "split"}, film={"size": [8, 8]}).to_toml()
    study = study_from_toml(text.replace("[effects]", '[effects]\nenvironment = "sky.png"'), folder=tmp_path)
    assert study.scene.environment == str(tmp_path / "sky.png")
    assert scene_from_toml(study.scene.to_toml()) == study.scene
    with pytest.raises(ImageError, match=r"sky\.png"):
        paint(trace(study.scene), PICTURE)
    point = next(iter(study.with_overrides({"lens.r": 0.5}).points()))
    assert point.scene.environment == study.scene.environment
