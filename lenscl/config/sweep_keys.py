"""The keys of a sweep against the scene: each must point somewhere, once, at what can differ from point to point."""

from __future__ import annotations

import itertools
from collections.abc import Iterator, Mapping
from typing import Any

from lenscl.config.axes import Values
from lenscl.config.keys import Place, key_problem, never_swept, parameter_names, places, rivals_of, whole_of
from lenscl.config.problems import key_text
from lenscl.config.scene import Scene
from lenscl.config.sweep import Sweep


def check_keys(sweep: Sweep, scene: Scene, problems: list[str]) -> None:
    """Report keys of the sweep that point nowhere, twice to one place, or to what no point can have."""
    document = scene.document(plain=False)
    known = places(document)
    _add_swept_parameters(known, sweep)
    parts_of: dict[str | None, list[Place]] = {}
    for name, place in known.items():
        parts_of.setdefault(whole_of(name), []).append(place)
    seen: dict[tuple[int, str, int | str | None], str] = {}
    groups = [("sweep.axes", sweep.axes), *((f"sweep.zip[{i}]", group) for i, group in enumerate(sweep.zips))]
    for at, group in groups:
        for key, _ in group:
            if not _check_key(at, key, known, document, problems):
                continue
            whole, own = known.get(whole_of(key) or ""), known[key]
            if own.identity in seen or (whole is not None and whole.identity in seen):
                other = seen.get(own.identity) or seen[whole.identity if whole is not None else own.identity]
                problems.append(f"{at}.{key_text(key)}: varies already, by {other}; keep one of the two")
            for part in parts_of.get(key, ()):
                if part.identity in seen:
                    problems.append(f"{at}.{key_text(key)}: varies already in part, by {seen[part.identity]}")
            for rival in rivals_of(key):
                if rival in known and any(identity[:2] == known[rival].identity[:2] for identity in seen):
                    problems.append(f"{at}.{key_text(key)}: varies with {rival} in its place; keep one of the two")
            seen[own.identity] = f"{at}.{key_text(key)}"
    for index, point in enumerate(sweep.include):
        for key in point:
            _check_key(f"sweep.include[{index}]", key, known, document, problems)
    varying = dict.fromkeys(sweep.axis_keys())
    listed = ", ".join(list(varying)[:8]) or "none"
    for index, pattern in enumerate(sweep.exclude):
        for key in pattern:
            if key not in varying:
                problems.append(f"sweep.exclude[{index}].{key_text(key)}: does not vary; the keys that do: {listed}")


def _check_key(at: str, key: str, known: Mapping[str, Place], document: Mapping[str, Any], problems: list[str]) -> bool:
    if never_swept(key) or key == "title" or key.split(".")[0] in ("output", "sweep"):
        problems.append(f"{at}.{key_text(key)}: cannot vary from point to point")
        return False
    problem = key_problem(key, known, document)
    if problem is not None:
        problems.append(f"{at}.{problem}")
    return problem is None


def _add_swept_parameters(known: dict[str, Place], sweep: Sweep) -> None:
    """Add the parameters of surfaces that the sweep itself puts in: whether a point has them, the point will say."""
    for key, values in _listed(sweep):
        place = known.get(key)
        if not key.endswith(".surface") or place is None:
            continue
        for formula in (value for value in values if isinstance(value, str)):
            for name in parameter_names(formula):
                known.setdefault(f"{key.removesuffix('.surface')}.{name}", Place(place.table, name, None))


def _listed(sweep: Sweep) -> Iterator[tuple[str, tuple[Any, ...]]]:
    """Yield the keys whose values are listed one by one, and those values."""
    for key, axis in itertools.chain(sweep.axes, *sweep.zips):
        if isinstance(axis, Values):
            yield key, axis.values
    for point in sweep.include:
        for key, value in point.items():
            yield key, (value,)
