"""Random scenes of solids that lie in one another, touch, overlap or stand apart, and rays that try them.

A scene is drawn in two steps: its form, what a kernel is compiled for, from one seed, and its numbers from another. A
group of solids is written in a frame of its own, where faces that touch have round coordinates; the frame is stretched,
turned and moved as a whole, or left where it is, so that rays along its axes meet faces, edges and corners exactly.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
import tomli_w
from numpy.typing import NDArray

from lenscl.config import Scene, scene_from_toml
from lenscl.tracing.placement import Placement

Array = NDArray[np.float64]
Table = dict[str, Any]
Random = np.random.Generator

_SIDE = 0.35  # half that of the usual solid
_EXPRESSIONS = (
    "x^4 + y^4 + z^4 - 0.03",
    "max(x^2 + y^2 - 0.1, abs(z) - 0.25)",
    "min((x - 0.15)^2 + y^2 + z^2 - 0.06, (x + 0.15)^2 + y^2 + z^2 - 0.06)",
    "max(x^2 + y^2 + z^2 - 0.16, 0.04 - x^2 - y^2)",
    "x^2 + y^2 + z^2 - 0.12 - 0.01*sin(9*x)*cos(7*y)",
    "max(abs(x), max(abs(y), abs(z))) - 0.3",
    "sqrt(x^2 + y^2 + 2*z^2) - 0.35",
    "exp(x^2 + y^2 + 2*z^2) - 1.15",
    "abs(x)^1.5 + abs(y)^1.5 + abs(z)^1.5 - 0.15",
    "max(x^2 + y^2 + z^2 - 0.16, 0.09 - x^2 - y^2 - z^2)",
)
_CATALOGUE: tuple[Table, ...] = (
    {"surface": "sphere", "r": 0.4},
    {"surface": "ellipsoid", "a": 0.45, "b": 0.3, "c": 0.35},
    {"surface": "torus", "R": 0.3, "r": 0.12},
    {"surface": "superellipsoid", "e1": 0.5, "e2": 0.8, "stretch": [0.3, 0.3, 0.3]},
    {"surface": "heart", "stretch": [0.4, 0.4, 0.4]},
    {"surface": "bifolia", "stretch": [0.2, 0.2, 0.2]},
    {"surface": "barth_sextic", "stretch": [0.25, 0.25, 0.25]},
    {"surface": "biconvex", "R1": 0.6, "R2": 0.8, "thickness": 0.3, "diameter": 0.7},
    {"surface": "plano_convex", "R": 0.5, "thickness": 0.3, "diameter": 0.8},
    {"surface": "meniscus", "R1": 0.5, "R2": 0.9, "thickness": 0.2, "diameter": 0.7},
    {"surface": "rod", "diameter": 0.5, "length": 0.6},
    {"surface": "prism"},
    {"surface": "cone"},
)
_NAMES = ("prism", "cone")  # whose parameters are the catalogue's own


@dataclass(frozen=True, slots=True, kw_only=True)
class Arrangement:
    """A scene and its rays."""

    name: str
    scene: Scene
    text: str
    origins: Array  # (N, 3)
    directions: Array  # (N, 3), unit


def expression(text: str, half: float = 0.75) -> Table:
    """Return the table of a solid that lies within so much of its own origin."""
    return {"surface": text, "bounds": [[-half] * 3, [half] * 3]}


def _box(a: Array, b: Array) -> Table:
    """Return the box between two corners, by its six planes."""
    middle, half = (a + b) / 2, (b - a) / 2
    parts = [
        f"abs({axis}{f' - {m:.17g}' if m > 0 else f' + {-m:.17g}' if m < 0 else ''}) - {h:.17g}"
        for axis, m, h in zip("xyz", middle.tolist(), half.tolist(), strict=True)
    ]
    return {"surface": f"max({', '.join(parts)})", "bounds": [(a - 0.1).tolist(), (b + 0.1).tolist()]}


def _any_solid(rng: Random) -> Table:
    if rng.random() < 0.45:
        return expression(str(rng.choice(_EXPRESSIONS)))
    table = dict(_CATALOGUE[rng.integers(len(_CATALOGUE))])
    return table | ({"stretch": [0.35] * 3} if table["surface"] in _NAMES else {})


def _scaled(table: Table, by: float) -> Table:
    return table | {"stretch": [by * x for x in table.get("stretch", [1.0, 1.0, 1.0])]}


def _moved(table: Table, to: Any) -> Table:
    return table | {"centre": np.asarray(to, np.float64).tolist()}


def _apart(form: Random, numbers: Random) -> list[Table]:
    count = form.integers(2, 5)
    return [_moved(_any_solid(form), [1.6 * (i - (count - 1) / 2), 0.0, 0.1 * i]) for i in range(count)]


def _within(form: Random, numbers: Random) -> list[Table]:
    count = form.integers(2, 5)
    kinds = [_any_solid(form) for _ in range(count)]
    return [
        _moved(_scaled(kind, 0.45**i * float(numbers.uniform(0.7, 1.2))), 0.06 * numbers.normal(size=3) * (i > 0))
        for i, kind in enumerate(kinds)
    ]


def _overlap(form: Random, numbers: Random) -> list[Table]:
    kinds = [_any_solid(form) for _ in range(form.integers(2, 6))]
    return [_moved(kind, np.round(numbers.uniform(-0.3, 0.3, 3), 2)) | _turn(numbers, 0.5) for kind in kinds]


def _concentric(form: Random, numbers: Random) -> list[Table]:
    kind, scales = _any_solid(form), np.sort(numbers.choice([0.3, 0.5, 0.7, 0.9, 1.0], form.integers(2, 5)))[::-1]
    return [_scaled(kind, float(scale)) for scale in scales]


def _twins(form: Random, numbers: Random) -> list[Table]:
    kind = _any_solid(form)
    more = [_moved(_any_solid(form), numbers.uniform(-0.3, 0.3, 3))] if form.random() < 0.5 else []
    return [kind, dict(kind), *more]


def _spelled_twins(form: Random, numbers: Random) -> list[Table]:
    pairs = (
        ({"surface": "sphere", "r": 0.4}, {"surface": "ball", "diameter": 0.8}),
        ({"surface": "sphere", "r": 0.4}, expression("sqrt(x^2 + y^2 + z^2) - 0.4")),
        ({"surface": "ball", "diameter": 0.8}, expression("max(x^2 + y^2 + z^2 - 0.16, z - 0.1)")),
        ({"surface": "rod", "diameter": 0.5, "length": 0.6}, expression("max(x^2 + y^2 - 0.0625, abs(z) - 0.3)")),
        ({"surface": "ellipsoid", "a": 0.4, "b": 0.3, "c": 0.2}, {"surface": "sphere", "stretch": [0.4, 0.3, 0.2]}),
        (expression("x^4 + y^4 + z^4 - 0.03"), expression("(x^4 + y^4 + z^4 - 0.03)*(2 + x)")),
    )
    return [dict(each) for each in pairs[form.integers(len(pairs))]]


def _slabs(form: Random, numbers: Random) -> list[Table]:
    """Stack boxes: common faces over all their area, or over a part of it, where edges lie on faces."""
    heights = np.cumsum([-0.4, *numbers.choice([0.1, 0.2, 0.3, 0.25], 4)])
    widths = numbers.choice([0.3, 0.3, 0.4, 0.5], 4) if form.random() < 0.6 else np.full(4, 0.4)
    return [
        _box(np.array([-w, -w, low]), np.array([w, w, high]))
        for w, low, high in list(zip(widths, heights, heights[1:], strict=False))[: form.integers(2, 5)]
    ]


def _bricks(form: Random, numbers: Random) -> list[Table]:
    """Put boxes on a coarse grid: they share corners, edges, parts of faces, or volume."""
    boxes = []
    for _ in range(form.integers(2, 6)):
        a = numbers.integers(-2, 2, 3)
        boxes.append(_box(0.2 * a, 0.2 * (a + numbers.integers(1, 3, 3))))
    return boxes


def _halves(form: Random, numbers: Random) -> list[Table]:
    """Cut a solid by planes through its frame: the parts are cemented."""
    whole = str(form.choice(["x^2 + y^2 + z^2 - 0.16", "x^4 + y^4 + z^4 - 0.03", "max(abs(x), abs(y), abs(z)) - 0.35"]))
    plane = str(form.choice(["z", "x - z", "x + 2*y - z - 0.05", "z - 0.1"]))
    parts = [expression(f"max({whole}, {plane})"), expression(f"max({whole}, -({plane}))")]
    if form.random() < 0.3:
        parts = [expression(f"max({whole}, {plane}, y)"), expression(f"max({whole}, {plane}, -y)"), parts[1]]
    return parts


def _doublet(form: Random, numbers: Random) -> list[Table]:
    radii = numbers.choice([1.2, 0.8, -0.9, -1.5, 2.0], 4)
    curvatures, diameter = (1.0 / radii).tolist(), 0.7
    tables, z = [], -0.3
    for i in range(form.integers(2, 4)):
        thickness = float(numbers.choice([0.25, 0.3, 0.35]))
        singlet = {"surface": "conic_singlet", "c1": curvatures[i], "c2": curvatures[i + 1], "thickness": thickness}
        tables.append(_moved(singlet | {"diameter": diameter}, [0.0, 0.0, z + thickness / 2]))
        z += thickness
    return tables


def _lens_on_window(form: Random, numbers: Random) -> list[Table]:
    thickness = 0.3
    convex = {"surface": "plano_convex", "R": 0.5, "thickness": thickness, "diameter": 0.8}
    window = _box(np.array([-0.5, -0.5, 0.15]), np.array([0.5, 0.5, 0.35]))
    more = [_moved({"surface": "sphere", "r": 0.1}, [0.0, 0.0, 0.25])] if form.random() < 0.5 else []
    return [convex, window, *more]


def _kissing(form: Random, numbers: Random) -> list[Table]:
    r, s = float(numbers.choice([0.3, 0.25])), float(numbers.choice([0.3, 0.2]))
    ball = _moved({"surface": "sphere", "r": s}, [0.0, 0.0, r + s])
    other = _moved({"surface": "sphere", "r": s}, [0.0, 0.0, r - s])  # touches from within
    return [{"surface": "sphere", "r": r}, ball, *([other] if form.random() < 0.5 else [])]


def _flush(form: Random, numbers: Random) -> list[Table]:
    """Let a coin into a slab: one face of it lies in the slab's."""
    slab = _box(np.array([-0.5, -0.5, -0.25]), np.array([0.5, 0.5, 0.25]))
    coin = expression("max(x^2 + y^2 - 0.04, abs(z - 0.125) - 0.125)")
    more = [_moved({"surface": "rod", "diameter": 0.2, "length": 0.5}, [0.25, 0.0, 0.0])] if form.random() < 0.5 else []
    return [slab, coin, *more]


def _glass(form: Random, numbers: Random) -> list[Table]:
    """Fill a glass: wall and ground of the liquid are those of the glass."""
    glass = expression("max(x^2 + y^2 - 0.16, abs(z) - 0.4, min(0.09 - x^2 - y^2, -0.3 - z)*1)")
    liquid = expression("max(x^2 + y^2 - 0.09, -0.3 - z, z - 0.1)")
    straw = _moved({"surface": "rod", "diameter": 0.1, "length": 0.8}, [0.05, 0.0, 0.1]) | {"rotate": [0.0, 20.0, 0.0]}
    return [glass, liquid, *([straw] if form.random() < 0.5 else [])]


def _filled_shell(form: Random, numbers: Random) -> list[Table]:
    shell = expression("max(x^2 + y^2 + z^2 - 0.16, 0.09 - x^2 - y^2 - z^2)")
    core = {"surface": "sphere", "r": 0.3}
    more = [{"surface": "sphere", "r": 0.15}] if form.random() < 0.5 else []
    return [shell, core, *more]


def _prism_cube(form: Random, numbers: Random) -> list[Table]:
    cube = "max(max(abs(x), abs(y), abs(z)) - 0.35, {})"
    return [expression(cube.format("x - z")), expression(cube.format("z - x"))]


def _near(form: Random, numbers: Random) -> list[Table]:
    """Leave a gap between two faces, or let them overlap, by little."""
    gap = float(numbers.choice([-1, 1]) * 10.0 ** -float(numbers.integers(3, 12)))
    if form.random() < 0.5:
        return [
            _moved({"surface": "sphere", "r": 0.3}, [0.0, 0.0, -0.3]),
            _moved({"surface": "sphere", "r": 0.3}, [0.0, 0.0, 0.3 + gap]),
        ]
    slab = expression("max(x^2 + y^2 - 0.16, abs(z) - 0.15)")
    return [_moved(slab, [0.0, 0.0, -0.15]), _moved(slab, [0.0, 0.0, 0.15 + gap])]


ARRANGEMENTS: dict[str, Callable[[Random, Random], list[Table]]] = {
    "apart": _apart,
    "one in another": _within,
    "overlap": _overlap,
    "concentric": _concentric,
    "the same twice": _twins,
    "the same in other words": _spelled_twins,
    "stacked slabs": _slabs,
    "bricks": _bricks,
    "halves": _halves,
    "doublet": _doublet,
    "lens on a window": _lens_on_window,
    "kissing": _kissing,
    "flush": _flush,
    "filled glass": _glass,
    "filled shell": _filled_shell,
    "prism cube": _prism_cube,
    "nearly touching": _near,
}


def _turn(rng: Random, share: float) -> Table:
    if rng.random() >= share:
        return {}
    angles = rng.choice([0.0, 30.0, 45.0, 90.0, 180.0], 3) if rng.random() < 0.5 else rng.uniform(-180, 180, 3).round(1)
    return {"rotate": angles.tolist()}


def drawn(
    form_seed: int, seed: int, rays: int, only: str = "", scale: float = 1.0, shift: float = 0.0, away: float = 1.0
) -> Arrangement:
    """Return the arrangement of two seeds: of what its kernel is compiled for, and of its numbers.

    The whole is scaled, then shifted along (1, -1, 1), and rays start so many times farther away.
    """
    form, numbers = np.random.default_rng([1, form_seed]), np.random.default_rng([2, form_seed, seed])
    name = only or list(ARRANGEMENTS)[form_seed % len(ARRANGEMENTS)]
    tables = ARRANGEMENTS[name](form, numbers)

    # Place the group: not at all, or as a whole
    kind = ("as it is", "moved", "turned", "stretched")[form.integers(4)]
    stretch = numbers.choice([1.0, 0.5, 1.5], 3) if kind == "stretched" else np.ones(3)
    turn = _turn(numbers, 1.0).get("rotate", [0.0] * 3) if kind in ("turned", "stretched") else [0.0] * 3
    at = np.round(numbers.uniform(-0.3, 0.3, 3), 2) if kind != "as it is" else np.zeros(3)
    frame = Placement.of(
        scene_from_toml(_text([_placed({"surface": "sphere", "n": 1.5}, stretch, turn, at)])).lenses[0]
    )
    is_free = any("rotate" in table for table in tables)  # each has its own turn: only moved
    tables = [
        _moved(table, np.add(table.get("centre", [0.0] * 3), at))
        if is_free
        else _placed(table, stretch, turn, frame.to_world @ np.array(table.get("centre", [0.0] * 3)) + at)
        for table in tables
    ]
    indices = form.permutation([1.5, 1.5, 1.7, 1.3, 1.0, 2.0])
    priorities = form.choice([-1, 0, 1, 2], len(tables)).tolist() if form.random() < 0.5 else [0] * len(tables)
    opaque = form.integers(len(tables)) if form.random() < 0.2 else -1
    for i, table in enumerate(tables):
        table |= {"name": f"l{i}", "n": float(indices[i]), "priority": int(priorities[i])}
        table |= {"absorbs": True} if i == opaque else {}

    for table in tables:
        size, centre = np.array(table.get("stretch", [1.0] * 3)), np.array(table["centre"])
        if (scale, shift) != (1.0, 0.0):
            table |= {
                "stretch": (scale * size).tolist(),
                "centre": (scale * centre + shift * np.array([1.0, -1.0, 1.0])).tolist(),
            }
    text = _text(tables, medium=float(form.choice([1.0, 1.0, 1.3])))
    origins, directions = _rays(numbers, frame, rays, is_exact=kind == "as it is")
    if away != 1.0:
        origins = origins - 2.0 * (away - 1.0) * directions
    if (scale, shift) != (1.0, 0.0):
        origins = scale * origins + shift * np.array([1.0, -1.0, 1.0])
    return Arrangement(name=name, scene=scene_from_toml(text), text=text, origins=origins, directions=directions)


def _placed(table: Table, stretch: Array, turn: Any, at: Array) -> Table:
    own = np.array(table.get("stretch", [1.0] * 3))
    return _moved(table, at) | {"stretch": (stretch * own).tolist(), "rotate": list(turn)}


def _text(tables: list[Table], medium: float = 1.0) -> str:
    return tomli_w.dumps(
        {
            "source": {"at": [0.0, 0.0, 4.0]},
            "film": {"corner": [-1.0, 1.0, 2.0], "right": [2.0, 0.0, 0.0], "down": [0.0, -2.0, 0.0], "size": [8, 8]},
            "picture": {"corner": [-4.0, 4.0, -3.0], "right": [8.0, 0.0, 0.0], "down": [0.0, -8.0, 0.0]},
            "medium": {"n": medium},
            "lens": tables,
            "numerics": {"max_events": 32},
        }
    )


_ROUND = np.array([-0.5, -0.4, -0.3, -0.25, -0.2, -0.1, 0.0, 0.0, 0.0, 0.1, 0.15, 0.2, 0.25, 0.3, 0.4, 0.5])


def _rays(rng: Random, frame: Placement, count: int, *, is_exact: bool) -> tuple[Array, Array]:
    """Return rays through the frame: anyhow, along its axes and diagonals through round places, and from within."""
    along = rng.normal(size=(count, 3))
    through = rng.uniform(-0.45, 0.45, (count, 3))
    steps = rng.choice([-1.0, 0.0, 0.0, 1.0], (count, 3))
    is_round = (rng.random(count) < 0.4) & steps.any(axis=1)
    along[is_round], through[is_round] = steps[is_round], rng.choice(_ROUND, (count, 3))[is_round]
    from_within = rng.random(count) < 0.25
    back = np.where(from_within & ~is_round, 0.0, 2.0)[:, None]
    if is_exact:
        return through - back * along, along / np.linalg.norm(along, axis=1, keepdims=True)
    local = through - back * along
    world, ahead = local @ frame.to_world.T + frame.centre, along @ frame.to_world.T
    return world, ahead / np.linalg.norm(ahead, axis=1, keepdims=True)
