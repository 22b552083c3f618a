"""The scenes that every benchmark uses, and the rows that a wish of scenes, methods and precisions comes to."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from functools import cache
from pathlib import Path
from typing import Literal

from lenscl.codegen import Precision, carried
from lenscl.config import Scene, load_study
from lenscl.device import Device
from lenscl.errors import LensclError, StudyError
from lenscl.methods import METHODS
from lenscl.tracing import methods_of

# Beside the package in a checkout, inside it in a wheel
_PACKAGE = Path(__file__).resolve().parent.parent.parent
_HOMES = (_PACKAGE / "configs" / "bench", _PACKAGE.parent / "configs" / "bench")
_PRECISIONS: tuple[Precision, ...] = ("double", "single")

DEFAULT_SCENES = ("close",)
DEFAULT_METHODS = ("auto", "march")


@dataclass(frozen=True, slots=True, kw_only=True)
class Row:
    """What is measured as one."""

    name: str
    scene: Scene = field(repr=False)
    method: str
    precision: Precision

    @property
    def carried(self) -> Literal["single", "double"]:
        """The precision that rays are carried in: what the device's peak is taken in."""
        return carried(self.precision)

    def __str__(self) -> str:
        return f"{self.name} {self.method} {self.precision}"


@cache
def scene_files() -> Mapping[str, Path]:
    """Return the study file of every benchmark scene by its name, such as "torus-close"."""
    for home in _HOMES:
        found = {path.stem: path for path in sorted(home.glob("*.toml"))}
        if found:
            return found
    raise LensclError("the benchmark's scenes are missing from the installation; install lenscl again")


def plan_rows(
    scenes: Iterable[str], methods: Iterable[str], precisions: Iterable[Precision], device: Device
) -> tuple[list[Row], list[str]]:
    """Return the rows to measure, scene by scene, and why rows are left out.

    Parameters
    ----------
    scenes, methods, precisions : iterable of str
        Names, each once or more; empty for the usual ones. A scene is named whole or by a part: "close", "torus".
    device : Device
        Where; without double precision of its own it is measured in single unless double is asked for.

    Raises
    ------
    StudyError
        If a name is unknown, or nothing is left to measure.
    """
    problems: list[str] = []
    names = _named_scenes(tuple(scenes) or DEFAULT_SCENES, problems)
    wanted = tuple(dict.fromkeys(methods)) or DEFAULT_METHODS
    known = ("auto", *METHODS)
    problems += [f'--method: "{name}" is unknown; known are {", ".join(known)}' for name in wanted if name not in known]
    if problems:
        raise StudyError(problems)
    usual = _PRECISIONS if device.has_double else ("single",)
    rows, left_out = [], []
    for name in names:
        scene = load_study(scene_files()[name]).scene
        for method in wanted:
            try:
                methods_of(scene.replace({"numerics.method": method}))
            except StudyError as error:
                left_out += [f"{name}: left out: {problem}" for problem in error.problems]
                continue
            for precision in dict.fromkeys(precisions) or usual:
                rows.append(Row(name=name, scene=scene, method=method, precision=precision))
    if not rows:
        raise StudyError(left_out)
    return rows, left_out


def _named_scenes(wanted: Iterable[str], problems: list[str]) -> list[str]:
    chosen: list[str] = []
    for asked in wanted:
        fit = [name for name in scene_files() if asked == name or asked in name.split("-")]
        if not fit:
            known = ", ".join(scene_files())
            problems.append(f'--scene: "{asked}" is unknown; known are {known}, and parts of these: close, torus')
        chosen += [name for name in fit if name not in chosen]
    return chosen
