"""The work list of a sweep: every point of a study times every picture, in the study's order.

Input: a Study. Output: a SweepPlan, from which the runs come one by one, so that 10^5 points cost no memory.
"""

from __future__ import annotations

import hashlib
import json
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from pathlib import Path
from typing import Any

from lenscl.accuracy import largest_size
from lenscl.config import Needs, Point, Scene, Study
from lenscl.errors import ImageError, StudyError
from lenscl.imaging import refuse_unseen
from lenscl.sweep.pictures import SourcePicture, as_text, fingerprint, survey
from lenscl.sweep.store import Planned
from lenscl.sweep.work import ImageWork, PointWork
from lenscl.tracing import study_needs, with_needs
from lenscl.version import program_version

_INDEX_DIGITS = 5  # as many as max_points has by default: adding points to a study renames no output
_STRUCTURAL = ("effects.", "numerics.")  # keys whose numbers, too, may change the kernel


@dataclass(frozen=True)
class SweepPlan:
    """What a sweep is going to do; making it reads the pictures' bytes and writes nothing."""

    study: Study
    out: Path
    pictures: tuple[SourcePicture, ...]
    program: str = field(default_factory=program_version)

    @cached_property
    def point_count(self) -> int:
        """How many points the study has."""
        return self.study.point_count()

    @property
    def run_count(self) -> int:
        """How many images the sweep makes."""
        return self.point_count * len(self.pictures)

    @cached_property
    def study_mark(self) -> str:
        """What tells this study's file from others, without saying where it lies."""
        place = str((self.study.path or Path()).resolve())
        return hashlib.sha256(place.encode("utf-8", "surrogateescape")).hexdigest()[:16]

    def runs(self) -> Iterator[Planned]:
        """Yield every run in work order: the points in theirs, the pictures of a point together."""
        for point in self.study.points():
            yield from self.runs_of(point)

    def runs_of(self, point: Point) -> Iterator[Planned]:
        """Yield the runs of one point."""
        described = _described(point)
        around = self._environment_digest(point)
        for number, picture in enumerate(self.pictures):
            yield Planned(
                output=self.output_name(point.index, picture),
                position=point.index * len(self.pictures) + number,
                point=point.index,
                values=dict(point.values),
                picture=picture.shown,
                key=self._key(described, self._metadata(described, point.values, picture), picture, around),
            )

    def output_name(self, index: int, picture: SourcePicture) -> str:
        """Return `<index>-<picture>.<ext>`."""
        digits = max(_INDEX_DIGITS, len(str(self.point_count - 1)))
        return f"{index:0{digits}d}-{picture.name}.{self.study.output.format}"

    def metadata(self, point: Point, picture: SourcePicture) -> dict[str, Any]:
        """Return what an output carries of its making: no clock, duration, host, device or place on disk."""
        return self._metadata(_described(point), point.values, picture)

    @cached_property
    def needs(self) -> Needs:
        """What any point needs, on which it hangs what `auto` compiles in: the same at all points."""
        return study_needs(self.study)

    def scene_of(self, point: Point) -> Scene:
        """Return a point's scene as it is traced."""
        return with_needs(point.scene, self.needs)

    def work_at(self, point: Point, numbers: Sequence[int]) -> PointWork:
        """Return the unit of work that makes some images of a point, by the numbers of their pictures.

        Raises
        ------
        StudyError
            If the point's values do not go together.
        """
        pictures = [self.pictures[number] for number in numbers]
        return PointWork(
            index=point.index,
            scene=self.scene_of(point),
            like=self._like(point),
            size=self._largest_size,
            format=self.study.output.format,
            images=tuple(
                ImageWork(
                    picture=picture,
                    output=self.out / self.output_name(point.index, picture),
                    metadata=self.metadata(point, picture),
                )
                for picture in pictures
            ),
        )

    def _like(self, point: Point) -> Scene | None:
        """Return the scene whose plan serves all points of this one's structure: the first in the study's order.

        It is the same one whatever an earlier run has done already, so that a sweep that goes on makes what it would
        have made in one go.
        """
        if point.scene.numerics.accuracy is None:
            return None
        text = structure_text(point)
        if text not in self._first:
            first = next(other for other, structure in self.structures() if structure == text)
            try:
                self._first[text] = self.scene_of(first)
            except StudyError:  # it fails alone, and the others plan for themselves
                self._first[text] = None
        return self._first[text]

    @cached_property
    def _first(self) -> dict[str, Scene | None]:
        return {}

    @cached_property
    def _largest_size(self) -> tuple[int, int]:
        return largest_size(self.study.scene, self.study.images)

    def structures(self) -> Iterator[tuple[Point, str]]:
        """Yield every point with a text of what may decide its kernel: equal texts, equal kernels.

        Numbers are arguments of a kernel; its text hangs on the axes that are no plain numbers, and on those of
        `[numerics]` and `[effects]`.
        """
        for point in self.study.points():
            yield point, structure_text(point)

    @cached_property
    def asks_accuracy(self) -> bool:
        """Whether any point asks for an accuracy, so that rows say what was achieved."""
        return self.study.scene.numerics.accuracy is not None or "numerics.accuracy" in self.study.axes

    def _metadata(self, scene: str, values: Mapping[str, Any], picture: SourcePicture) -> dict[str, Any]:
        return {
            "program": self.program,
            "title": self.study.title,
            "picture": picture.shown.rsplit("/", 1)[-1],
            "parameters": dict(values),
            "scene": scene,
        }

    def _environment_digest(self, point: Point) -> str | None:
        """Return the digest of the image that a point's lenses reflect; None for none, or one that cannot be read."""
        try:
            shown = point.scene.environment
        except StudyError:  # the point fails alone, when its turn comes
            return None
        if not isinstance(shown, str) or shown == "picture":
            return None
        if shown not in self._digests:
            try:
                self._digests[shown] = fingerprint(Path(shown))[0]
            except ImageError:
                self._digests[shown] = None
        return self._digests[shown]

    @cached_property
    def _digests(self) -> dict[str, str | None]:
        return {}

    def _key(self, scene: str, metadata: Mapping[str, Any], picture: SourcePicture, around: str | None) -> str:
        """Digest all that the bytes of an output depend on."""
        parts = {
            "scene": scene,
            "picture": picture.digest,
            **({} if around is None else {"environment": around}),
            "output": repr(self.study.output),
            "metadata": metadata,  # the program's sources among it
        }
        text = json.dumps(parts, sort_keys=True, default=str)
        return hashlib.sha256(text.encode("utf-8", "backslashreplace")).hexdigest()


def plan_sweep(study: Study, out: Path | None = None) -> SweepPlan:
    """Lay out a sweep without doing any of it.

    Parameters
    ----------
    study : Study
        What to do.
    out : Path, optional
        The folder for images and table; default `out/<study>` below the current folder, after the study's file.

    Raises
    ------
    StudyError
        If the study names no picture, none is found, one lies where the sweep would write, no wavelength is seen, no
        point is left, or the folder cannot be used by its name.
    """
    if study.scene.picture.images is None:
        raise StudyError(
            [
                "picture.images: a sweep paints pictures, and the study names none; "
                'give a file or pattern such as images = "pictures/*", or write the ray map alone with `lenscl map`'
            ]
        )
    if "effects.dispersion" not in study.axes:  # else a point that shows nothing fails alone
        refuse_unseen(study.scene.wavelengths)
    pictures = survey(study.require_images())
    if out is None:
        out = Path("out") / (study.path.stem if study.path is not None else "study")
    if as_text(out) != str(out):
        raise StudyError([f"{as_text(out)}: the folder's name is not UTF-8; choose another with -o"])
    if any(picture.path.absolute().parent.resolve() == out.absolute().resolve() for picture in pictures):
        raise StudyError(
            [f"picture.images: pictures are read from {out}, where the sweep would write; choose a folder with -o"]
        )
    plan = SweepPlan(study, out, pictures)
    if plan.point_count == 0:
        raise StudyError(["sweep.exclude: no point of the study is left; see `lenscl check`, and exclude fewer"])
    return plan


def _described(point: Point) -> str:
    """Return a scene's canonical text without its pictures' names: which files there are besides changes no image.

    Nor does the folder of the image that lenses reflect. A point whose values do not go together is described by what
    is wrong with it; it fails alone, when its turn comes.
    """
    try:
        scene = point.scene
    except StudyError as error:
        return f"# {error}"
    shown = scene.environment
    if isinstance(shown, str) and shown != "picture":
        scene = replace(scene, environment=as_text(Path(shown).name))
    return replace(scene, picture=replace(scene.picture, images=None)).to_toml()


def structure_text(point: Point) -> str:
    """Return what may decide a point's kernel; see `SweepPlan.structures`."""
    deciding = {
        key: value
        for key, value in point.values.items()
        if key.startswith(_STRUCTURAL) or _is_of_places(key) or not _is_numeric(value)
    }
    return json.dumps(deciding, sort_keys=True, default=str)


def _is_of_places(key: str) -> bool:
    """Return whether a key has the places of an array, whose number decides how many lenses there are."""
    return key.startswith("lens.") and key.endswith(".at")


def _is_numeric(value: Any) -> bool:
    if isinstance(value, list | tuple):
        return all(_is_numeric(part) for part in value)
    return isinstance(value, int | float) and not isinstance(value, bool)
