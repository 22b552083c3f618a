"""Errors reach another process whole: pools and clusters send them."""

from __future__ import annotations

import pickle

import pytest

from lenscl import errors

SAMPLES = {
    errors.LensclError: ("film.png: is a folder",),
    errors.StudyError: (["lens.n: must be positive", "film.size: is missing"],),
    errors.ExpressionError: ("unknown name 'w'", "x + w", 4),
    errors.DiskFullError: ("disk/out.png: make room on the disk",),
    errors.ImageError: ("film.png: is cut short",),
    errors.NoDeviceError: ("no OpenCL device",),
    errors.BuildError: ("the driver's log",),
    errors.TraceError: ("the film is too large",),
}


def test_every_error_has_a_sample() -> None:
    kinds = {each for each in vars(errors).values() if isinstance(each, type)}
    assert set(SAMPLES) == {each for each in kinds if issubclass(each, errors.LensclError)}


@pytest.mark.parametrize("kind", SAMPLES, ids=lambda kind: kind.__name__)
def test_a_pickled_error_says_and_holds_what_it_did(kind: type[errors.LensclError]) -> None:
    error = kind(*SAMPLES[kind])
    copy = pickle.loads(pickle.dumps(error))
    assert type(copy) is kind
    assert str(copy) == str(error)
    assert vars(copy) == vars(error)
    assert copy.exit_code == error.exit_code
