"""Films: what painting is given of a ray map, and that it needs no map."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from imaging.devices import counting
from imaging.maps import every_pixel, landing, random_pixels

from lenscl.device import Device
from lenscl.effects import EFFECTS
from lenscl.effects.colours import LUMINANCE
from lenscl.imaging import DevicePicture, Film, FilmSamples, film_of, paint, paint_film
from lenscl.imaging.film import Layer, Spectrum, Supersamples
from lenscl.imaging.outputs import OUTPUT_USES
from lenscl.reference.paint import paint as twin
from lenscl.status import RayStatus

ROWS, COLUMNS = 5, 6


def some_places(seed: int, *shape: int) -> Any:
    return np.random.default_rng(seed).uniform(0, 1, (*shape, 2))


def samples_at(st: Any, device: Device, **more: Any) -> FilmSamples:
    return FilmSamples(device, st, np.full(st.shape[:-1], RayStatus.PICTURE, np.uint8), **more)


def test_a_film_is_painted_without_a_map(opencl_device: Device) -> None:
    """Layers, weights and further samples, put together by hand; against the twin and sums by numpy."""
    rng = np.random.default_rng(2)
    pixels = random_pixels(rng, (4, 7, 3), "float64")
    each = [some_places(seed, ROWS, COLUMNS) for seed in (3, 4)]
    weights = rng.random((ROWS, COLUMNS, 3))
    finer = some_places(5, 4, 9)
    refined = np.array([0, 7, 8, 29])
    more = Supersamples(refined, 9, lambda part: samples_at(finer[part], opencl_device), together=20)
    layers = (
        Layer(samples_at(each[0], opencl_device, weights=weights), more),
        Layer(samples_at(each[1], opencl_device)),
    )
    matrices = rng.random((2, 3, 3))
    film = Film(layers, Spectrum(matrices, np.array([0.5, 0.5])))

    first, second, mean = (twin(st, np.zeros(st.shape[:-1], np.uint8), pixels) for st in (*each, finer))
    first *= weights
    first.reshape(-1, 3)[refined] = mean.mean(axis=1)
    expected = first @ matrices[0].T + second @ matrices[1].T
    painted = paint_film(film, DevicePicture.of(opencl_device, pixels))
    assert film.shape == painted.shape[:2] == (ROWS, COLUMNS)
    np.testing.assert_allclose(painted, expected, atol=1e-12)


@pytest.mark.parametrize("is_spectral", [False, True])
def test_samples_go_up_once_a_map(is_spectral: bool, opencl_device: Device) -> None:
    device, rng = counting(opencl_device), np.random.default_rng(6)
    raymap = landing(some_places(7, ROWS, COLUMNS), device)
    added = {
        "transmittance": rng.random((ROWS, COLUMNS)),
        "transmission": rng.random((ROWS, COLUMNS, 3)),
        "jacobian": rng.random((ROWS, COLUMNS, 2, 2)) * 0.1,
    }
    layers = 1
    if is_spectral:
        layers = 3
        added = {name: np.stack([array] * layers) for name, array in added.items()}
        added["wavelengths"] = np.array([450.0, 550.0, 650.0])
        raymap = replace(raymap, st=np.stack([raymap.st] * layers), status=np.stack([raymap.status] * layers))
    film = film_of(replace(raymap, added=added))
    assert len(film.layers) == layers
    for seed in range(4):
        pixels = random_pixels(np.random.default_rng(seed), (4, 3 + seed, 3), "uint8")
        paint_film(film, DevicePicture.of(device, pixels))
    ups = [shape for shape, _ in device.uploads if shape[:2] == (ROWS, COLUMNS)]
    assert sorted(ups) == sorted(
        [(ROWS, COLUMNS), (ROWS, COLUMNS, 2), (ROWS, COLUMNS, 3), (ROWS, COLUMNS, 2, 2)] * layers
    )


def test_weights_are_held_for_each_kind_of_picture(opencl_device: Device) -> None:
    weights = np.random.default_rng(8).random((ROWS, COLUMNS, 3))
    device = counting(opencl_device)
    samples = samples_at(some_places(9, ROWS, COLUMNS), device, weights=weights)
    for dtype, kind in (("uint8", "float32"), ("float32", "float32"), ("float64", "float64")):
        for is_grey, expected in ((True, weights @ LUMINANCE[:, np.newaxis]), (False, weights)):
            there = samples.weights_there(dtype, is_grey=is_grey)
            assert there is not None
            found = np.empty(expected.shape, kind)
            device.download(there, found)
            np.testing.assert_array_equal(found, expected.astype(kind))
    assert len(device.uploads) == 4  # of float32 and float64, grey and in colour
    assert samples_at(some_places(9, ROWS, COLUMNS), device).weights_there("uint8", is_grey=True) is None


def test_samples_that_fit_stay_on_the_device_and_others_come_in_parts(opencl_device: Device) -> None:
    finer, numbers = some_places(10, 6, 4), np.arange(6)
    for together, parts in ((24, 1), (23, 2), (8, 3), (1, 6)):
        more = Supersamples(numbers, 4, lambda part: samples_at(finer[part], opencl_device), together)
        found = list(more.parts())
        assert len(found) == parts
        np.testing.assert_array_equal(np.concatenate([part.pixels for part in found]), numbers)
        np.testing.assert_array_equal(np.concatenate([part.samples.st for part in found]), finer)
        assert (next(more.parts()) is found[0]) == (parts == 1)


def test_one_wavelength_is_a_layer_and_a_spectrum_and_the_d_line_a_layer_alone(opencl_device: Device) -> None:
    """The rank of a map's arrays says which of the two it is."""
    plain = landing(every_pixel(COLUMNS, ROWS), opencl_device)
    share = np.full((ROWS, COLUMNS), 0.5)
    listed = replace(
        plain,
        st=plain.st[np.newaxis],
        status=plain.status[np.newaxis],
        added={"wavelengths": np.array([550.0]), "transmittance": share[np.newaxis]},
    )
    films = [film_of(replace(plain, added={"transmittance": share})), film_of(listed)]
    assert [film.spectrum is None for film in films] == [True, False]
    for film in films:
        ((samples, more),) = [(layer.samples, layer.more) for layer in film.layers]
        assert more is None
        assert samples.shape == film.shape == (ROWS, COLUMNS)
        assert samples.weights is not None
        assert samples.weights.shape == (ROWS, COLUMNS, 3)
    pixels = np.random.default_rng(1).random((ROWS, COLUMNS, 3))
    np.testing.assert_allclose(paint(listed, pixels), 0.5 * pixels, atol=1e-6)


def test_every_array_of_an_effect_says_what_becomes_of_it() -> None:
    outputs = {
        output.name: output
        for effect in EFFECTS.values()
        for variants in (*effect.variants.values(), effect.counted)
        for variant in variants
        for output in variant.adds
    }
    assert len(outputs) >= 7
    assert outputs.keys() == OUTPUT_USES.keys()
    for name, output in outputs.items():
        use = OUTPUT_USES[name]
        assert len(use.channels) == (len(output.members) if len(output.members) > 1 else 0)
        assert not use.weighs or len(output.members) in (1, 3)
