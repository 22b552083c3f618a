"""How many rays are looked at, by what a ray of the scene costs: operations are counted, no clock is read.

A verdict rests on the rays that it looked at. Were their number a matter of seconds, the same study would be judged by
other rays on a busy machine.
"""

from __future__ import annotations

from lenscl.config import Scene
from lenscl.expr.graph import walk

# Operations of arithmetic that another one costs in a kernel, bounds and derivatives included; 1 where it is left out
_COSTS = dict.fromkeys(("exp", "log", "sin", "cos", "tan", "atan2", "tanh"), 20) | {"pow": 1000, "norm": 1000}
_AGAIN = 100  # times the cost of a ray that is traced again in a higher precision
_CHEAP = 100  # operations of a ray, up to which as many rays are looked at as ever


def operations(scene: Scene, again: float = 0.0) -> float:
    """Return about how many operations one look at every lens of a scene takes.

    Parameters
    ----------
    scene : Scene
    again : float
        Share of the rays through a lens that are traced again in a higher precision.
    """
    nodes = (node for lens in scene.lenses for node in walk([lens.surface.expression]))
    return sum(_COSTS.get(node.op, 1) for node in nodes) * (1.0 + _AGAIN * again)


def affordable(scene: Scene, again: float, fewest: int, most: int) -> int:
    """Return how many rays to look at: `most` in a plain scene, in others fewer by as much as a ray costs more."""
    cost = max(operations(scene, again) / _CHEAP, 1.0)
    return int(min(max(most / cost, fewest), most))
