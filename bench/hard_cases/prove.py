"""Prove how the rays of a case end, and what becomes of that where every number of the problem is moved a little.

The moves are those that rounding makes: of where a ray starts and where it goes, of every lens and the numbers of its
expression, of indices and screens, of each point where a normal is taken and of the direction behind it, each by up to
a given share of its size.

They come in pairs of opposite signs. The first four pairs move the four numbers of a ray, two across it of its origin
and two of its direction, in orthogonal ways: but for what the other moves take away, the root of the sum of squares of
what they do is at least what any move of these four does, to first order.
"""

from __future__ import annotations

import hashlib
from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from lenscl.accuracy.rounding import reach
from lenscl.config import Lens, Scene, scene_from_toml
from lenscl.config.scene import Frozen
from lenscl.expr import Expr
from lenscl.expr.graph import node, number, walk
from lenscl.hardcases import LEVELS, ROUNDING, ULPS, Answers, Array, Case, Expected, Level, Moved, number_of
from lenscl.materials import Constant, Material
from lenscl.reference.oracle import Proof, prove_pixels, prove_rays
from lenscl.reference.stops import picture_stops
from lenscl.status import RayStatus

# Whether a pair adds to the two offsets and the two turns of a ray, or takes away
_SIGNS = ((1, 1, 1, 1), (1, -1, 1, -1), (1, 1, -1, -1), (1, -1, -1, 1))
_MORE_PAIRS = 9  # for rays that the first show to be unstable or sensitive
_EXACT_BITS = 2048  # at the most for rays as they are: 255 events take so many
_BITS = 256  # at the most for moved rays: what takes more is not stable
_SENSITIVE = 100.0  # condition number, in picture coordinates for a relative move of every number

Shift = Callable[[float], float]  # from a number's size to its move


def expected_of(case: Case) -> Expected:
    """Prove a case's rays as they are, and as they are moved."""
    scene = scene_from_toml(case.proved_as or case.scene)
    if case.origins is None or case.directions is None:
        exact = prove_pixels(scene, range(scene.film.rows * scene.film.columns), most_bits=_EXACT_BITS)
    else:
        starts = _starts(case, case.origins).tolist()
        exact = prove_rays(scene, starts, case.directions.tolist(), most_bits=_EXACT_BITS)
    reasons = np.array([number_of(proof.reason) for proof in exact], np.uint8)
    moved = {}
    for level in LEVELS:
        moved[level], beside = _moved(case, scene, exact, level)
        for ray, proof in zip(moved[level].ray.tolist(), beside, strict=True):
            if level == "double" and not reasons[ray]:
                reasons[ray] = number_of(proof.reason)
    lengths = _lengths(exact, len(scene.lenses)) if case.counts_lengths else None
    return Expected(answers=_answers(exact), moved=moved, reasons=reasons, lengths=lengths)


def _starts(case: Case, origins: Array) -> Array:
    return origins if case.counts_from is None else np.broadcast_to(case.counts_from, origins.shape)


def _moved(case: Case, scene: Scene, exact: list[Proof], level: Level) -> tuple[Moved, list[Proof]]:
    """Return what becomes of rays that are moved, and the proofs of what lies beside those that are not stable."""
    size = ULPS * ROUNDING[level]
    most, squares = np.zeros(len(exact)), np.zeros(len(exact))
    longer = np.zeros((len(exact), len(scene.lenses) + 1))
    is_stable = np.array([proof.status is not None for proof in exact])
    beside: list[tuple[int, Proof]] = []

    def look(rays: NDArray[np.intp], pair: int) -> Array:
        """Move some rays both ways; return the larger change of the places of those that end alike."""
        change = np.zeros(len(exact))
        for sign in (1.0, -1.0):
            for i, proof in zip(rays.tolist(), _beside(case, scene, rays, pair, sign * size), strict=True):
                beside.append((i, proof))
                if proof.status is None or (proof.status, proof.events) != (exact[i].status, exact[i].events):
                    is_stable[i] = False
                elif proof.st is not None:
                    change[i] = max(change[i], _apart(proof, exact[i]))
                    if case.counts_lengths:
                        longer[i] = np.maximum(longer[i], np.abs(_longer(proof, exact[i])))
        return change

    for pair in range(len(_SIGNS)):
        change = look(np.arange(len(exact)), pair)
        most, squares = np.maximum(most, change), squares + change**2
    again = np.flatnonzero(~is_stable | (most > _SENSITIVE * size))
    for pair in range(len(_SIGNS), len(_SIGNS) + _MORE_PAIRS):
        most = np.maximum(most, look(again, pair))
    spread = np.maximum(most, np.sqrt(squares))
    kept = [(i, proof) for i, proof in beside if not is_stable[i]]
    proofs = [proof for _, proof in kept]
    moved = Moved(
        spread=spread,
        is_stable=is_stable,
        beside=_answers(proofs),
        ray=np.array([i for i, _ in kept], np.int32),
        length_spread=longer if case.counts_lengths else None,
    )
    return moved, proofs


def _beside(case: Case, scene: Scene, rays: NDArray[np.intp], pair: int, size: float) -> list[Proof]:
    """Prove some rays moved; all but the sign of the size follows from the case and the pair."""
    seed = int.from_bytes(hashlib.sha256(f"{case.name} {pair}".encode()).digest()[:8], "little")
    random = np.random.default_rng(seed)

    def shares(*shape: int) -> Array:
        return random.uniform(0.5, 1.0, shape) * np.where(random.random(shape) < 0.5, -1.0, 1.0)

    def shift(of: float) -> float:
        return size * of * float(shares(1)[0])

    if pair >= len(_SIGNS):  # paths that lie between are met by smaller moves
        size *= 2.0 ** -float(random.integers(0, 7))
    moved = _scene_moved(scene, shift, with_lenses=not (case.starts_exactly or case.keeps_contact))
    if case.starts_exactly:  # where a film's rays do
        moved = replace(moved, source=scene.source)
    if case.keeps_contact and picture_stops(scene):  # nor is the picture moved away from the faces that it lies on
        moved = replace(moved, picture=scene.picture)
    moves = size * shares(len(rays), 256, 2, 3) * np.array([[reach(scene)], [1.0]])

    def shake(ray: int, event: int) -> tuple[list[float], list[float]]:
        point, direction = moves[ray, event].tolist()
        return point, direction

    if case.origins is None or case.directions is None:
        return prove_pixels(moved, rays.tolist(), most_bits=_BITS, shake=shake)
    origins, directions = _starts(case, case.origins), case.directions
    signs = _SIGNS[pair] if pair < len(_SIGNS) else shares(4)
    u, v = _across(directions)
    steps = size * np.maximum(np.abs(origins).max(axis=1), reach(scene))[:, None] * (signs[0] * u + signs[1] * v)
    bends = size * np.linalg.norm(directions, axis=1)[:, None] * (signs[2] * u + signs[3] * v)
    starts = origins + (0.0 if case.starts_exactly else 1.0) * steps
    return prove_rays(moved, starts[rays].tolist(), (directions + bends)[rays].tolist(), most_bits=_BITS, shake=shake)


def _across(directions: Array) -> tuple[Array, Array]:
    """Return two unit vectors across each direction and each other, turned about it anyhow, but always the same."""
    ahead = directions / np.linalg.norm(directions, axis=1, keepdims=True)
    u = np.cross(ahead, np.random.default_rng(1).normal(size=ahead.shape))
    u /= np.linalg.norm(u, axis=1, keepdims=True)
    return u, np.cross(ahead, u)


def _scene_moved(scene: Scene, shift: Shift, *, with_lenses: bool) -> Scene:
    """Return a scene all of whose numbers are moved; indices that are equal stay so."""
    factors: dict[float, float] = {}

    def index(material: Material) -> Material:
        n = factors.setdefault(material.n, material.n + shift(material.n))
        return replace(material, name=None, index=Constant(n))

    def screen(one: Any) -> Any:
        right, down = _vector(one.right, shift), _vector(one.down, shift)
        return replace(
            one, keeps="corner", anchor=_vector(one.corner, shift), unscaled_right=right, unscaled_down=down, scale=1.0
        )

    source = scene.source
    return replace(
        scene,
        source=replace(
            source,
            at=None if source.at is None else _vector(source.at, shift),
            direction=None if source.direction is None else _vector(source.direction, shift),
        ),
        film=screen(scene.film),
        picture=screen(scene.picture),
        medium=index(scene.medium),
        lenses=tuple(
            replace(_lens_moved(lens, shift) if with_lenses else lens, material=index(lens.material))
            for lens in scene.lenses
        ),
    )


def _lens_moved(lens: Lens, shift: Shift) -> Lens:
    x, y, z = (angle + shift(180.0 / np.pi) for angle in lens.rotate)
    a, b, c = (part + shift(part) for part in lens.stretch)
    return replace(
        lens,
        centre=_vector(lens.centre, shift),
        rotate=(x, y, z),
        stretch=(a, b, c),
        values=Frozen({name: value + shift(value) for name, value in lens.values.items()}),
        surface=replace(lens.surface, expression=_numbers_moved(lens.surface.as_written, shift), written=None),
    )


def _vector(v: tuple[float, float, float], shift: Shift) -> tuple[float, float, float]:
    size = max(abs(part) for part in v)
    x, y, z = (part + shift(size) for part in v)
    return x, y, z


def _numbers_moved(expression: Expr, shift: Shift) -> Expr:
    """Return an expression whose numbers are moved, but for exponents."""
    moved: dict[Expr, Expr] = {}
    for each in walk([expression]):
        if each.op == "number" and each.value is not None:
            moved[each] = number(each.value + shift(each.value))
        elif each.op == "power":
            moved[each] = node(each.op, moved[each.args[0]], each.args[1])
        else:
            moved[each] = node(each.op, *(moved[arg] for arg in each.args)) if each.args else each
    return moved[expression]


def _answers(proofs: list[Proof]) -> Answers:
    places = [
        (-1.0, -1.0) if proof.st is None or proof.status is None else tuple(float(x.mid()) for x in proof.st)
        for proof in proofs
    ]
    return Answers(
        status=np.array([RayStatus.UNDECIDED if p.status is None else p.status for p in proofs], np.uint8),
        events=np.array([proof.events for proof in proofs], np.uint8),
        st=np.array(places, np.float64).reshape(-1, 2),
    )


def _lengths(proofs: list[Proof], lenses: int) -> Array:
    nothing = [0.0] * (lenses + 1)
    return np.array([[float(x.mid()) for x in proof.lengths] or nothing for proof in proofs], np.float64)


def _longer(one: Proof, other: Proof) -> Array:
    return np.array([float((a - b).mid()) for a, b in zip(one.lengths, other.lengths, strict=True)])


def _apart(one: Proof, other: Proof) -> float:
    assert one.st is not None
    assert other.st is not None
    return max(float(abs(a - b).mid()) for a, b in zip(one.st, other.st, strict=True))
