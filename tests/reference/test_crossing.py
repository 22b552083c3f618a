from __future__ import annotations

from flint import arb, ctx

from lenscl.reference.crossing import _refined
from lenscl.reference.jets import Jet


def test_a_root_is_refined_where_the_slope_over_parts_is_told_worse_than_over_the_whole() -> None:
    """Radii are rounded up: a slope that is barely known over a bracket may not be so over a part of it."""
    with ctx.workprec(128):
        whole = arb(1.25, 1.25)

        def along(t: arb) -> Jet:
            slope = arb(1) if t.rad() >= whole.rad() else arb(0, 2)
            return Jet(t - 1, (slope,))

        root = _refined(along, whole)
        assert root.contains(arb(1))
        assert root.rad() < 1e-30
