"""A unit of work of a sweep, and what comes of it, as values.

A `PointWork` says what is to be made at one point; `lenscl.sweep.making` makes it; a `PointResult` says what became of
it. All are frozen and can be pickled: only paths of files, numbers and texts cross between whoever plans and keeps the
table, and whoever works.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Literal

from lenscl.accuracy import Achieved, SelfCheck
from lenscl.config import Scene
from lenscl.status import RayStatus
from lenscl.sweep.pictures import SourcePicture
from lenscl.sweep.spans import Stage, total_spans
from lenscl.sweep.store import Stamp


@dataclass(frozen=True, slots=True, kw_only=True)
class ImageWork:
    """A picture to be seen at a point, and where the image goes."""

    picture: SourcePicture
    output: Path
    metadata: Mapping[str, Any]  # that the image carries


@dataclass(frozen=True, slots=True, kw_only=True)
class PointWork:
    """A point of a study with the images that are to be made there.

    Attributes
    ----------
    index : int
        Of the point.
    scene : Scene
        What is traced.
    like : Scene or None
        A scene of the same structure whose plan is tried first; see `Planner.trace`.
    size : (int, int)
        Columns and rows of the study's largest picture, whose pixels an accuracy may be in.
    format : str
        Of the images, such as "png".
    images : tuple of ImageWork
    """

    index: int
    scene: Scene
    like: Scene | None
    size: tuple[int, int]
    format: str
    images: tuple[ImageWork, ...]


@dataclass(frozen=True, slots=True, kw_only=True)
class MapSummary:
    """What stays of a ray map once its pictures are painted.

    Attributes
    ----------
    counts : mapping of RayStatus to int
        Film pixels by how their rays ended.
    trace_seconds : float
        The device's time for the trace.
    device : str
        The device's label.
    kernel : str
        The kernel's key.
    checks : SelfCheck
        What the self-checks of its rays found.
    achieved : Achieved or None
        How accurate it is, where the scene asks for an accuracy.
    """

    counts: Mapping[RayStatus, int]
    trace_seconds: float
    device: str
    kernel: str
    checks: SelfCheck
    achieved: Achieved | None


@dataclass(frozen=True, slots=True, kw_only=True)
class ImageResult:
    """What became of one image.

    Attributes
    ----------
    output : str
        File name.
    state : "done" or "failed"
    error : str or None
        Why it failed.
    stamp : Stamp or None
        The file as it was written.
    paint_seconds, write_seconds : float
        Wall time; encoding counts as writing.
    spans : mapping of Stage to float
        Wall seconds by stage. The first image that is made at a point carries the stages that its pictures share, so
        that sums over images are sums over work.
    """

    output: str
    state: Literal["done", "failed"]
    error: str | None = None
    stamp: Stamp | None = None
    paint_seconds: float = 0.0
    write_seconds: float = 0.0
    spans: Mapping[Stage, float] = field(default_factory=dict)


@dataclass(frozen=True, slots=True, kw_only=True)
class PointResult:
    """What became of a point: its map, None if it could not be traced or needed none, and its images in order."""

    index: int
    map: MapSummary | None
    images: tuple[ImageResult, ...]

    @property
    def spans(self) -> Mapping[Stage, float]:
        """Wall seconds by stage."""
        return total_spans(image.spans for image in self.images)
