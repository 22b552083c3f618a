"""A small valid study, and what a text of it is refused for."""

from __future__ import annotations

from collections.abc import Callable

import pytest

from lenscl.config import study_from_toml
from lenscl.errors import StudyError

BASE = """
[source]
at = [0, 0, 4]
[film]
centre = [0, 0, 2.5]
right = [2, 0, 0]
down = [0, -2, 0]
size = [8, 6]
[picture]
centre = [0, 0, -2.5]
right = [6, 0, 0]
down = [0, -6, 0]
[[lens]]
surface = "torus"
R = 0.7
r = 0.25
n = 1.5
"""


@pytest.fixture(scope="session")
def base() -> str:
    return BASE


@pytest.fixture(scope="session")
def problems() -> Callable[[str], tuple[str, ...]]:
    """Return the problems of a study's text; none where it is valid."""

    def found(text: str) -> tuple[str, ...]:
        try:
            study_from_toml(text)
        except StudyError as error:
            return error.problems
        return ()

    return found
