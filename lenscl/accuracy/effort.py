"""How many rays to judge, by the cost of a ray of the scene, in operations.

No clock decides it. Else the same study would be judged by other rays on a busy machine, and could get another verdict.
"""

from __future__ import annotations

from lenscl.config import Scene
from lenscl.expr.graph import walk

# Cost in a kernel, bounds and derivatives included, in additions; 1 for operations that are not listed
_COSTS = dict.fromkeys(("exp", "log", "sin", "cos", "tan", "atan2", "tanh"), 20) | {"pow": 1000, "norm": 1000}
_COSTS |= dict.fromkeys(("asin", "acos", "atan", "sinh", "cosh"), 20)
_AGAIN = 100  # factor on the cost of a ray that is traced again in a higher precision
_COPIES = 8  # of an array, that a ray is near to
_CHEAP = 100  # operations of a ray: up to that, the largest number of rays is judged


def operations(scene: Scene, again: float = 0.0) -> float:
    """Return about how many operations it takes to evaluate every lens of a scene once.

    Parameters
    ----------
    scene : Scene
    again : float
        Share of the rays through a lens that are traced again in a higher precision.
    """
    every = 0.0
    for group in scene.lenses.groups:
        nodes = walk([group.lens.surface.expression])
        every += min(len(group), _COPIES) * sum(_COSTS.get(node.op, 1) for node in nodes)
    return every * (1.0 + _AGAIN * again)


def affordable(scene: Scene, again: float, fewest: int, most: int) -> int:
    """Return how many rays to judge: `most` if a ray is cheap, else fewer in proportion, but at least `fewest`."""
    cost = max(operations(scene, again) / _CHEAP, 1.0)
    return int(min(max(most / cost, fewest), most))
