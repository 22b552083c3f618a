"""Whether a film or a picture shows things longer one way than the other: its spans against its size in pixels."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Sequence
from contextlib import suppress
from itertools import islice
from pathlib import Path

from lenscl.config import Scene, Study
from lenscl.errors import ImageError, StudyError
from lenscl.imaging import read_size
from lenscl.lenses import Vec3

_MOST_IMAGES = 1000  # of a folder, whose heads are read
_MOST_POINTS = 250
_SLIGHT = 0.01  # relative: no eye sees a circle that is longer by less


Sizes = Sequence[tuple[Path, tuple[int, int]]]  # columns and rows of images


def sizes_of(images: Iterable[Path]) -> Sizes:
    """Return the sizes of images, of a long list those at its start; what cannot be read is told of elsewhere."""
    found = []
    for image in islice(images, _MOST_IMAGES):
        with suppress(ImageError):
            found.append((image, read_size(image)))
    return found


def shown_scenes(study: Study) -> Iterator[Scene]:
    """Yield the scenes of a study whose films and pictures may differ; the first alone, where none of them varies."""
    varies = any(key.startswith(("film.", "picture.", "effects.")) for key in study.axes)
    for point in islice(study.points(), _MOST_POINTS if varies else 1):
        with suppress(StudyError):  # values that do not go together: the point fails alone
            yield point.scene


def stretch_notes(scenes: Iterable[Scene], images: Iterable[Path]) -> list[str]:
    """Return what is said of the film, the picture and its images, each once however many scenes it is true of."""
    sizes, found = sizes_of(images), dict[str, str]()
    for scene in scenes:
        for key, messages in (("film", stretched_film(scene)), ("picture", stretched_picture(scene, sizes))):
            for number, message in enumerate(messages):
                found.setdefault(f"{key} {number}", f"{key}: {message}")
    return list(found.values())


def stretched_film(scene: Scene) -> Iterator[str]:
    """Yield what is said of a film whose pixels are not square."""
    film = scene.film
    times = _stretch(film.right, film.down, film.size)
    if times is not None:
        down = _spelled(film.unscaled_down, times)
        columns, rows = film.columns, max(1, round(film.rows * times))
        yield (
            f"its pixels are {_how(times)}, so that what it shows is stretched: {_long(film.right)} along right over "
            f"{columns} columns, {_long(film.down)} along down over {film.rows} rows. "
            f"film.down = {down} keeps shapes, and so does film.size = [{columns}, {rows}]"
        )


def stretched_picture(scene: Scene, sizes: Sizes) -> Iterator[str]:
    """Yield what is said of a picture on which images of these sizes are stretched."""
    picture = scene.picture
    stretches = [(image, size, _stretch(picture.right, picture.down, size)) for image, size in sizes]
    found = [(image, size, times) for image, size, times in stretches if times is not None]
    if found:
        image, (columns, rows), times = found[0]
        shape = f"picture.right and picture.down, {_long(picture.right)} and {_long(picture.down)} long"
        some = f"{len(found)} of {len(sizes)} images are" if len(sizes) > 1 else "its image is"
        yield (
            f"{some} stretched by {shape}: the pixels of {image.name}, {columns} x {rows}, are {_how(times)}; "
            f"picture.down = {_spelled(picture.unscaled_down, times)} keeps its shape"
        )
    cells = _stretch(picture.right, picture.down, picture.size)
    if scene.effects["caustics"] and cells is not None:
        columns, rows = picture.size
        yield (
            f"what is painted in the light of effects.caustics is stretched, for the cells of picture.size are "
            f"{_how(cells)}; picture.size = [{columns}, {max(1, round(rows * cells))}] keeps shapes"
        )


def _stretch(right: Vec3, down: Vec3, size: tuple[int, int]) -> float | None:
    """Return how many times as high as wide pixels are; None where they are square as nearly as whole numbers allow."""
    (columns, rows), wide, high = size, math.hypot(*right), math.hypot(*down)
    times = (high / rows) / (wide / columns)
    if 1 in size or abs(math.log(times)) <= _SLIGHT:
        return None
    is_rounded = rows == round(columns * high / wide) or columns == round(rows * wide / high)
    return None if is_rounded else times


def _how(times: float) -> str:
    return f"{times:.3g} times as high as wide" if times > 1.0 else f"{1.0 / times:.3g} times as wide as high"


def _long(span: Vec3) -> str:
    return f"{math.hypot(*span):.6g}"


def _spelled(down: Vec3, times: float) -> str:
    return f"[{', '.join(f'{part / times + 0.0:.6g}' for part in down)}]"
