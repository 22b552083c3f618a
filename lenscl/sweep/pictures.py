"""The pictures of a sweep: their names, their content, and reading them ahead of their use."""

from __future__ import annotations

import hashlib
import os
import stat
import time
from collections import Counter
from collections.abc import Iterable, Sequence
from concurrent.futures import Future, ThreadPoolExecutor
from dataclasses import dataclass
from pathlib import Path
from types import TracebackType
from typing import Self

from lenscl.errors import ImageError
from lenscl.imaging import Picture, read_picture
from lenscl.sweep.spans import Clock

KEEP_BYTES = 512 * 2**20  # decoded pictures kept for the next point; what does not fit is decoded again
_LONGEST_NAME = 150  # bytes; leaves room for index, extension and a temporary name's mark in the 255 of a file name


@dataclass(frozen=True, slots=True)
class SourcePicture:
    """A picture file as it was when the sweep was planned."""

    path: Path
    shown: str  # as results name it: the path below the folder that all pictures share
    name: str  # what its outputs are called
    digest: str | None  # of its bytes; None if it cannot be read
    stamp: tuple[int, int] | None  # size and time of change
    error: str | None  # why it cannot be read


def survey(paths: Sequence[Path]) -> tuple[SourcePicture, ...]:
    """Read every picture's bytes once and give each a name of its own.

    Nothing is decoded: a file that is no picture is found when it is used. One that cannot be opened is noted.
    """
    folder = os.path.commonpath([path.absolute().parent for path in paths]) if paths else ""
    found = []
    for path, name in zip(paths, output_names(paths), strict=True):
        shown = as_text(path.absolute().relative_to(folder).as_posix())
        try:
            digest, stamp = fingerprint(path)
            found.append(SourcePicture(path, shown, name, digest, stamp, None))
        except ImageError as error:
            found.append(SourcePicture(path, shown, name, None, None, str(error)))
    return tuple(found)


def fingerprint(path: Path) -> tuple[str, tuple[int, int]]:
    """Return a file's digest, and its size and time of change."""
    try:
        mode = path.stat().st_mode
        if not stat.S_ISREG(mode):  # a pipe would keep whoever opens it waiting
            kind = "a folder" if stat.S_ISDIR(mode) else "no regular file"
            raise ImageError(f"{as_text(path)}: is {kind}, not a picture")
        with path.open("rb") as file:
            about = os.fstat(file.fileno())
            return hashlib.file_digest(file, "sha256").hexdigest(), (about.st_size, about.st_mtime_ns)
    except (OSError, ValueError) as error:  # ValueError: a zero byte in the name
        reason = getattr(error, "strerror", None) or error
        raise ImageError(f"{as_text(path)}: cannot be read: {reason}") from error


def output_names(paths: Iterable[Path]) -> list[str]:
    """Return what the outputs of each picture are called.

    A picture's stem; the whole file name where two stems are equal (in any case of letters); and where even those
    are equal, for files of different folders, a number in the study's order behind it.

    >>> output_names([Path("cat.png"), Path("dog.jpg"), Path("Dog.png"), Path("b/dog.jpg")])
    ['cat', 'dog.jpg', 'Dog.png', 'dog.jpg~2']
    """
    paths = list(paths)
    stems = [_shortened(as_text(path.stem)) for path in paths]
    shared = Counter(stem.casefold() for stem in stems)
    wanted = [
        stem if shared[stem.casefold()] == 1 else _shortened(as_text(path.stem)) + as_text(path.suffix)
        for path, stem in zip(paths, stems, strict=True)
    ]
    taken: set[str] = set()
    names = []
    for base in wanted:
        name, number = base, 1
        while name.casefold() in taken:
            number += 1
            name = f"{base}~{number}"
        taken.add(name.casefold())
        names.append(name)
    return names


class PictureReader:
    """Decodes pictures in a thread of its own, ahead of their use, and keeps what fits in a stated memory.

    Pictures come round in the same order at every point, so the first ones that fit stay for good: throwing out the
    least recently used would throw out exactly the one that is needed next.
    """

    def __init__(self, keep_bytes: int = KEEP_BYTES) -> None:
        self._room = keep_bytes
        self._pool = ThreadPoolExecutor(1, thread_name_prefix="lenscl-read")
        self._held: dict[SourcePicture, Picture | str] = {}  # decoded, or why it cannot be
        self._coming: dict[SourcePicture, Future[tuple[Picture, float]]] = {}

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()

    def close(self) -> None:
        """End the thread; what was not begun is not decoded any more."""
        self._pool.shutdown(wait=True, cancel_futures=True)

    def prefetch(self, source: SourcePicture) -> None:
        """Start decoding a picture, unless it is here or on its way."""
        if source not in self._held and source not in self._coming:
            self._coming[source] = self._pool.submit(_timed, source)

    def take(self, source: SourcePicture, clock: Clock) -> Picture:
        """Return a decoded picture; the clock gets the time to decode it, and the time waited for it.

        Raises
        ------
        ImageError
            If it cannot be read, or is no longer what it was when the sweep was planned; each time it is asked for.
        """
        if source not in self._held:
            self.prefetch(source)
            try:
                with clock.span("wait"):
                    picture, seconds = self._coming.pop(source).result()
            except ImageError as error:
                self._held[source] = str(error)
            else:
                clock.add("decode", seconds)
                if picture.pixels.nbytes > self._room:
                    return picture
                self._room -= picture.pixels.nbytes
                self._held[source] = picture
        found = self._held[source]
        if isinstance(found, str):
            raise ImageError(found)
        return found


def _timed(source: SourcePicture) -> tuple[Picture, float]:
    start = time.perf_counter()
    return _decode(source), time.perf_counter() - start


def _decode(picture: SourcePicture) -> Picture:
    if picture.error is not None:
        raise ImageError(picture.error)
    decoded = read_picture(picture.path)
    try:
        about = picture.path.stat()
        is_same = (about.st_size, about.st_mtime_ns) == picture.stamp
    except OSError:
        is_same = False
    if not is_same:
        raise ImageError(f"{picture.shown}: was changed while the sweep ran; run the same command again")
    return decoded


def _shortened(name: str) -> str:
    return name.encode()[:_LONGEST_NAME].decode(errors="ignore")


def as_text(name: str | Path) -> str:
    """Return a file's name as text that can be printed and stored, whatever bytes it is made of."""
    return os.fsencode(name).decode("utf-8", "backslashreplace")
