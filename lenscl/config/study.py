"""A study: a scene, the points of its sweep, its images and where its results go."""

from __future__ import annotations

import glob
import itertools
from collections.abc import Iterator, Mapping
from copy import deepcopy
from dataclasses import dataclass, field, replace
from functools import cached_property
from pathlib import Path
from typing import Any

from lenscl.config.build import read_scene, read_table, unknown_top_keys
from lenscl.config.keys import places, rivals_of, whole_of
from lenscl.config.load import parse_text, read_text
from lenscl.config.overrides import left_over, parted, written_into
from lenscl.config.problems import file_text, key_text, short, study_error
from lenscl.config.scene import Frozen, Scene
from lenscl.config.sweep import Sweep, check_count, read_sweep
from lenscl.config.sweep_keys import check_keys
from lenscl.config.tables import ENVIRONMENT, TOP_KEYS, OutputTable, SweepTable
from lenscl.errors import StudyError

_MOST_CHECKED = 1000  # points built when a study is read: every value of every axis, up to so many
_MOST_LOOKED_AT = 200_000  # points looked at to find them
_MOST_IMAGES = 100_000
_LONGEST_TITLE = 1000
_SWEEP_SETTINGS = ("mode", "samples", "seed", "max_points")


@dataclass(frozen=True, slots=True, kw_only=True)
class Output:
    """What is written: the format of the painted images."""

    format: str = "png"


@dataclass(frozen=True, kw_only=True)
class Point:
    """One combination of the values of a study's axes.

    `values` has every key of `study.axes`, in their order; None where the scene leaves a key out, or where another key
    of the point decides it, as `film.size` does for `film.size.rows`. The scene is built
    when it is first asked for, so that points are cheap to list.
    """

    index: int
    values: Mapping[str, Any]
    study_scene: Scene = field(repr=False)
    folder: Path = field(default=Path(), repr=False)  # of the study, from which files are named

    @cached_property
    def scene(self) -> Scene:
        """The scene of this point.

        Raises
        ------
        StudyError
            If these values do not go together; every problem names the point.
        """
        try:
            given = {key: value for key, value in self.values.items() if value is not None}
            return self.study_scene.replace(_placed(given, self.folder))
        except StudyError as error:
            listed = ", ".join(f"{key} = {short(value)}" for key, value in list(self.values.items())[:8])
            raise StudyError([f"{problem} (point {self.index}: {listed})" for problem in error.problems]) from None


@dataclass(frozen=True, slots=True, kw_only=True)
class Study:
    """A scene, the points of its sweep, its images and its output.

    Attributes
    ----------
    title : str
        The title; the file's name if the study has none.
    scene : Scene
        The scene with the values of its own tables.
    path : Path or None
        The file it came from.
    folder : Path
        The folder that `picture.images` and `effects.environment` are relative to.
    images : tuple of Path
        The files that `picture.images` matches, sorted; see `require_images`.
    sweep : Sweep
        The points.
    output : Output
        The form of the output.
    overrides : mapping
        The values that `with_overrides` set.
    """

    title: str
    scene: Scene
    path: Path | None
    folder: Path
    images: tuple[Path, ...]
    sweep: Sweep
    output: Output
    overrides: Mapping[str, Any]

    @property
    def axes(self) -> tuple[str, ...]:
        """The keys that vary, in the order of the columns of a table of results."""
        return self.sweep.axis_keys()

    def point_count(self) -> int:
        """Return how many points there are."""
        return self.sweep.count(self._defaults())

    def points(self) -> Iterator[Point]:
        """Yield the points one by one, in the order of their indices."""
        for index, values in enumerate(self.sweep.rows(self._defaults())):
            yield Point(index=index, values=Frozen(values), study_scene=self.scene, folder=self.folder)

    def require_images(self) -> tuple[Path, ...]:
        """Return the images.

        Raises
        ------
        StudyError
            If there are none; the message says where they were looked for.
        """
        patterns = self.scene.picture.images
        if patterns is None:
            raise study_error(['picture.images: is required to paint; add a pattern such as images = "pictures/*"'])
        if not self.images:
            written = short(patterns)
            raise study_error([f"picture.images: no file matches {written} in {file_text(self.folder)}"])
        return self.images

    def with_overrides(self, changes: Mapping[str, Any]) -> Study:
        """Return the study with some of its keys set, as `--set KEY=VALUE` does.

        Parameters
        ----------
        changes : mapping
            Value by key: any key of the scene, and `title`, `output.format`, `sweep.mode`, `sweep.samples`,
            `sweep.seed` and `sweep.max_points`. An axis of that key is held at the value.

        Raises
        ------
        StudyError
            With every problem, each led by its key.
        """
        study = self._overridden(changes)
        _check_points(study)
        return study

    def _overridden(self, changes: Mapping[str, Any]) -> Study:
        """Return the study with some of its keys set, its points not tried."""
        problems: list[str] = []
        outer, inner = parted(changes)
        title, output, sweep = self._with_outer(outer, problems)
        scene = self.scene
        try:
            scene = scene.replace(_placed(inner, self.folder))
        except StudyError as error:
            problems += error.problems
        known = places(self.scene.document(plain=False))
        for key, value in inner.items():
            for axis in sweep.axis_keys():
                if axis in known and key in known and known[axis].identity == known[key].identity:
                    sweep = sweep.hold(axis, value)
                elif axis == whole_of(key):
                    problems.append(f"{key_text(key)}: cannot be set, because the axis {axis} varies the whole of it")
                elif (whole_of(axis) or axis) in rivals_of(key):
                    problems.append(f"{key_text(key)}: cannot be set, because the axis {axis} stands in its place")
        if problems:
            raise study_error(problems)
        return replace(
            self,
            title=title,
            scene=scene,
            sweep=sweep,
            output=output,
            images=_find_images(scene, self.folder),
            overrides=Frozen({**self.overrides, **changes}),
        )

    def _with_outer(self, changes: Mapping[str, Any], problems: list[str]) -> tuple[str, Output, Sweep]:
        """Return the title, output and sweep with keys of theirs changed."""
        title, output, sweep = self.title, self.output, self.sweep
        settings: dict[str, Any] = {}
        for key, value in changes.items():
            table, _, name = key.partition(".")
            if key == "title":
                title = _read_title({"title": value}, title, problems)
            elif table == "output":
                output = _read_output({"output": {name: value}}, problems)
            elif name in _SWEEP_SETTINGS:
                settings[name] = value
            else:
                listed = ", ".join(f"sweep.{setting}" for setting in _SWEEP_SETTINGS)
                problems.append(f"{key_text(key)}: cannot be set; {listed} can, and the keys of the axes themselves")
        if settings:
            read = read_table(SweepTable, {"sweep": settings}, "sweep", problems.append)
            if read is not None:
                if "mode" in settings and (read.mode == "grid") != (sweep.mode == "grid"):
                    written = f"the axes are written for {short(sweep.mode)}, not {short(read.mode)}"
                    kinds = "an axis of a grid lists values, one of a sample is { min = ..., max = ... }"
                    problems.append(f"sweep.mode: {written}; change mode and axes in the file: {kinds}")
                sweep = replace(sweep, **{name: getattr(read, name) for name in settings})
                check_count(sweep, problems.append)
        return title, output, sweep

    def _defaults(self) -> dict[str, Any]:
        """Return what the scene says for every key that varies."""
        known = places(self.scene.document(plain=False))
        return {key: known[key].value() if key in known else None for key in self.axes}


def load_study(path: str | Path, overrides: Mapping[str, Any] | None = None) -> Study:
    """Read a study file.

    Parameters
    ----------
    path : str or Path
        A TOML file; `picture.images` is relative to its folder.
    overrides : mapping, optional
        Values by key, as `Study.with_overrides` takes them. They are set before the file is validated, so a key may be
        missing or invalid in the file.

    Raises
    ------
    StudyError
        With every problem, each with its key; with the file's name if it cannot be read.
    """
    file = Path(path)
    return study_from_toml(read_text(file), folder=file.parent, path=file, overrides=overrides)


def study_from_toml(
    text: str,
    *,
    folder: str | Path = ".",
    path: Path | None = None,
    overrides: Mapping[str, Any] | None = None,
) -> Study:
    """Read a study from a text.

    Parameters
    ----------
    text : str
        TOML, as a study file holds it.
    folder : str or Path
        What `picture.images` is relative to.
    path : Path, optional
        Where the text came from; it names the study where the text has no title.
    overrides : mapping, optional
        Keys to set before anything is judged; see `load_study`.

    Raises
    ------
    StudyError
        With every problem, each led by its key.
    """
    document, changes = parse_text(text, "study" if path is None else file_text(path)), overrides or {}
    try:
        study = _read_study(deepcopy(document) if changes else document, Path(folder), path)
    except StudyError as error:
        if not changes or not written_into(document, changes):
            raise
        try:
            study = _read_study(document, Path(folder), path)
        except StudyError as left:
            raise left_over(left, error) from None
    if changes:
        study = study._overridden(changes)
    _check_points(study)
    return study


def _read_study(document: dict[str, Any], folder: Path, path: Path | None) -> Study:
    """Return the study of a document, its points not tried."""
    problems: list[str] = []
    unknown_top_keys(document, TOP_KEYS, problems.append)
    title = _read_title(document, "study" if path is None else path.stem, problems)
    if isinstance(effects := document.get("effects"), dict):
        document["effects"] = _placed(effects, folder, ENVIRONMENT)
    if isinstance(lenses := document.get("lens"), list):
        document["lens"] = [_placed(lens, folder, "at") if isinstance(lens, dict) else lens for lens in lenses]
    scene = read_scene(document, problems)
    sweep = read_sweep(document, problems.append)
    output = _read_output(document, problems)
    if check_count(sweep, problems.append) and scene is not None:
        check_keys(sweep, scene, problems)
    if scene is None or problems:
        raise study_error(problems)
    return Study(
        title=title,
        scene=scene,
        path=path,
        folder=folder,
        images=_find_images(scene, folder),
        sweep=sweep,
        output=output,
        overrides=Frozen(),
    )


def scene_from_toml(text: str) -> Scene:
    """Return the scene of a study's text. The whole study is validated; its sweep and output are ignored.

    Raises
    ------
    StudyError
        With every problem, each led by its key.
    """
    return study_from_toml(text).scene


def parse_override(text: str) -> tuple[str, Any]:
    """Return the key and the value of a `KEY=VALUE`; VALUE is TOML, and a text where it is not.

    >>> parse_override("lens.stretch=[1, 2, 3]")
    ('lens.stretch', [1, 2, 3])
    >>> parse_override("lens.n=diamond")
    ('lens.n', 'diamond')
    """
    key, equals, written = (part.strip() for part in text.partition("="))
    if not equals or not key or not written:
        raise study_error([f"--set {key_text(text)}: must be KEY=VALUE, such as lens.r=0.2"])
    try:
        value = parse_text(f"value = {written}")
    except StudyError:
        return key, written
    return key, value["value"] if len(value) == 1 else written


def _read_title(document: Mapping[str, Any], default: str, problems: list[str]) -> str:
    title = document.get("title", default)
    if not isinstance(title, str) or len(title) > _LONGEST_TITLE:
        problems.append(f"title: must be a text of at most {_LONGEST_TITLE} characters, got {short(title)}")
        return default
    return title


def _read_output(document: Mapping[str, Any], problems: list[str]) -> Output:
    table = read_table(OutputTable, document, "output", problems.append)
    return Output() if table is None else Output(format=table.format)


def _check_points(study: Study) -> None:
    """Raise for points that cannot be built: every value of every axis is tried in the first point that has it."""
    if not study.axes:
        return
    seen: set[tuple[str, str]] = set()
    problems: list[str] = []
    built = 0
    for point in itertools.islice(study.points(), _MOST_LOOKED_AT):
        new = {(key, repr(value)) for key, value in point.values.items()} - seen
        if not new:
            continue
        seen |= new
        built += 1
        try:
            _ = point.scene
        except StudyError as error:
            problems += error.problems
        if built >= _MOST_CHECKED:
            break
    if problems:
        raise study_error(problems)


def _placed(values: Mapping[str, Any], folder: Path, *keys: str) -> dict[str, Any]:
    """Let names of files be names from here, as they are written from the study's folder.

    Those are an image that lenses reflect, and a file of places; under `keys`, or else under those of a scene.
    """
    placed = dict(values)
    for key, name in values.items():
        if isinstance(name, str) and name and (key in keys if keys else _names_file(key, name)):
            placed[key] = name if name == "picture" and not key.endswith("at") else str(folder / name)
    return placed


def _names_file(key: str, name: str) -> bool:
    """Return whether a key of the scene has the name of a file."""
    return (key == f"effects.{ENVIRONMENT}" and name != "picture") or (key.startswith("lens.") and key.endswith(".at"))


def _find_images(scene: Scene, folder: Path) -> tuple[Path, ...]:
    """Return what `picture.images` names, sorted, each once: all that a pattern matches, and any name as it stands.

    Nothing is dropped for not being a picture: what cannot be read, a missing file or a folder, is named by whoever
    reads it.
    """
    patterns = scene.picture.images
    found: set[Path] = set()
    for pattern in [patterns] if isinstance(patterns, str) else patterns or ():
        names = glob.iglob(pattern, root_dir=folder) if glob.has_magic(pattern) else [pattern]
        found.update(folder / name for name in itertools.islice(names, _MOST_IMAGES))
    return tuple(sorted(found))
