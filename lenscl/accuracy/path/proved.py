"""What the certified oracle says of a film pixel's ray, where python-flint is there to ask, and works."""

from __future__ import annotations

from lenscl.accuracy.path.values import Proved
from lenscl.config import Scene
from lenscl.reference import flint_trouble, oracle


def proved(scene: Scene, number: int, st: tuple[float, float] | None) -> Proved | None:
    """Prove a film pixel, numbered row by row; `st` is where it was traced to. None without python-flint."""
    if flint_trouble() is not None:
        return None
    (proof,) = oracle.prove_pixels(scene, [number])
    return Proved(
        status=proof.status,
        events=proof.events,
        distance=proof.distance(*st) if st is not None and proof.st is not None else None,
        bits=proof.bits,
        reason=proof.reason,
    )
