"""Keys that --set gives, written into a document that cannot be read without them.

A file whose own value is wrong, missing, or needs what is not installed, is read with what is set in its place.
"""

from __future__ import annotations

from collections.abc import Mapping
from contextlib import suppress
from typing import Any

from lenscl.config.keys import changed
from lenscl.config.problems import as_plain
from lenscl.errors import StudyError

_PARTS = ("source", "film", "picture", "medium", "effects", "numerics")  # tables of a scene beside its lenses


def parted(changes: Mapping[str, Any]) -> tuple[dict[str, Any], dict[str, Any]]:
    """Return the changes of a study's own keys, and those of its scene's."""
    outer = {key: value for key, value in changes.items() if key == "title" or key.split(".")[0] in ("output", "sweep")}
    return outer, {key: as_plain(value) for key, value in changes.items() if key not in outer}


def written_into(document: dict[str, Any], changes: Mapping[str, Any]) -> bool:
    """Write changes into a document, those that have a place there; return whether any was written."""
    outer, inner = parted(changes)
    written = [_write_outer(document, key, as_plain(value)) for key, value in outer.items()]
    written += [_hold_axis(document, key, value) for key, value in inner.items()]
    lenses = document.get("lens")
    if not isinstance(lenses, list) or not all(isinstance(lens, dict) for lens in lenses):
        return any(written)
    whole = {**{name: {} for name in _PARTS}, **document}
    if not all(isinstance(whole[name], dict) for name in _PARTS):
        return any(written)
    for key, value in inner.items():
        with suppress(StudyError):  # a key of no scene: told of when it is set in the scene, if that can be read
            changed(whole, {key: value})
            written.append(True)
    document |= {name: whole[name] for name in _PARTS if whole[name]}
    return any(written)


def _write_outer(document: dict[str, Any], key: str, value: Any) -> bool:
    name, _, inside = key.rpartition(".")
    table = document.setdefault(name, {}) if name else document
    if not isinstance(table, dict) or "." in name:
        return False
    table[inside] = value
    return True


def _hold_axis(document: Mapping[str, Any], key: str, value: Any) -> bool:
    """Let an axis that lists values have this one alone, as it will be held at it."""
    sweep = document.get("sweep")
    axes = sweep.get("axes") if isinstance(sweep, dict) else None
    if not isinstance(axes, dict) or key not in axes or (isinstance(axes[key], dict) and "min" in axes[key]):
        return False
    axes[key] = [value]
    return True


def left_over(left: StudyError, first: StudyError) -> StudyError:
    """Return the problems that are left when keys are set, those of the file itself first."""
    own = [problem for problem in first.problems if problem in left.problems]
    return StudyError([*own, *(problem for problem in left.problems if problem not in own)])
