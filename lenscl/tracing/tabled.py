"""Write the lenses of a scene down as the table that a kernel reads, with the hierarchy of their boxes."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from lenscl.codegen import KernelSource, Table, wide_levels
from lenscl.config import Scene
from lenscl.tracing.blur import blur_of, coat_noise, searched
from lenscl.tracing.hierarchy import Hierarchy, hierarchy_of, world_boxes
from lenscl.tracing.placement import Placement
from lenscl.tracing.tight import search_box

_SHARED = ("to_local", "to_world", "box_low", "box_high")  # by lenses that differ in where they stand


def table_numbers(scene: Scene, source: KernelSource) -> dict[str, ArrayLike]:
    """Return a value for every slot of a kernel's table, one row for each lens of its kind, but for the indices."""
    values: dict[str, ArrayLike] = {}
    for kind in source.structure.kinds:
        # What equal lenses share is made once
        made: dict[tuple[Any, ...], int] = {}
        placed: list[Mapping[str, NDArray[np.float64]]] = []
        shapes: list[Mapping[str, ArrayLike]] = []
        which, centres, kept = [], [], []
        blurs: list[Mapping[str, float]] = []
        reads: dict[str, list[Any]] = {name: [] for name, _ in source.structure.lens_reads}
        for number in kind.lenses:
            lens = scene.lenses[number]
            centres.append(lens.centre)
            for name, read in reads.items():
                read.append(getattr(lens, name))
            key = (id(lens.surface), id(lens.values), lens.stretch, lens.rotate)
            if (place := made.get(key)) is None:
                place = made[key] = len(made)
                kept.append(lens)  # so that no other object has its identity
                if source.structure.nests:
                    blurs.append(blur_of(lens, searched(lens, kind.method), source.structure.carried))
                low, high = search_box(lens)
                placed.append({**Placement.of(lens).numbers(), "box_low": low, "box_high": high})
                shapes.append(source.shape_values(number, lens.values))
            which.append(place)
        numbers = {name: np.stack([np.asarray(one[name]) for one in placed])[which] for name in _SHARED}
        numbers["centre"] = np.array(centres, dtype=np.float64)
        numbers["number"] = Table(source.structure).numbers(kind).astype(np.float64)
        if source.structure.nests:
            colours = np.array(source.structure.colours)[list(kind.lenses)]
            numbers |= {"colour": colours.astype(np.float64), "bit": 2.0**colours}
            numbers |= {name: np.array([one[name] for one in blurs])[which] for name in ("noise", "size")}
        numbers |= {name: np.array(read, dtype=np.float64) for name, read in reads.items()}
        if source.structure.coats:
            is_coated = isinstance(kind.mirror, tuple)
            noises = [coat_noise(lens, source.structure.carried) if is_coated else 0.0 for lens in kept]
            numbers["coat_noise"] = np.array(noises)[which]
        values |= {f"{kind.prefix}.lens.{name}": value for name, value in numbers.items()}
        for name in shapes[0]:
            rows = np.stack([np.asarray(one[name], dtype=np.float64) for one in shapes])[which]
            values[f"{kind.prefix}.shape.{name}"] = rows
    return values


def table_indices(scene: Scene, source: KernelSource) -> dict[str, ArrayLike]:
    """Return the values of the table that hang on refractive indices."""
    values: dict[str, ArrayLike] = {}
    for kind in source.structure.kinds:
        n = np.array([scene.lenses[number].n for number in kind.lenses], dtype=np.float64)
        indices = {"n": n, "eta_in": scene.n_medium / n, "eta_out": n / scene.n_medium}
        values |= {f"{kind.prefix}.lens.{name}": value for name, value in indices.items()}
    return values


def table_hierarchy(values: Mapping[str, ArrayLike], source: KernelSource, dtype: type[np.floating[Any]]) -> Hierarchy:
    """Return the boxes of the lenses as they stand in a table's values."""
    lows, highs, numbers = [], [], []
    for kind in source.structure.kinds:
        lens = {
            name: np.asarray(values[f"{kind.prefix}.lens.{name}"], dtype=np.float64) for name in (*_SHARED, "centre")
        }
        to_world = lens["to_world"].reshape(-1, 3, 3)
        low, high = world_boxes(to_world, lens["centre"], lens["box_low"], lens["box_high"])
        lows.append(low)
        highs.append(high)
        numbers.append(Table(source.structure).numbers(kind))
    levels = wide_levels(source.structure.width)
    return hierarchy_of(np.concatenate(lows), np.concatenate(highs), np.concatenate(numbers), dtype, levels)
