"""Write the bands of a surface on both sides of the jumps of its floors.

At the border of two cells mod(x, 1) is nearly 1 or nearly 0, and nothing between. Bounds from 0 to 1 would tell nothing
of what is made of it, and every ray that crosses a border would end undecided.
"""

from __future__ import annotations


def both_sides(prefix: str, name: str, floors: int) -> str:
    """Return the function of the leaves' bands, made of that on one side, which is called the same with `_on`.

    Bits of `way` say on which side of its jump each floor is taken. A lane takes another way than the first only where
    a jump may lie on its segment; what it finds on that way may fork again. So no lane depends on those beside it.

    Parameters
    ----------
    prefix, name : str
        Of the surface, and of the function.
    floors : int
        How many floors have a bit, 1 or more.
    """
    return f"""\
static inline void {prefix}_{name}(const {prefix}_parts_t *parts, {prefix}_t shape, band_t of_leaf[{prefix}_LEAVES]) {{
  maskv forks = (maskv)0;
  {prefix}_{name}_on(parts, shape, 0, &forks, of_leaf);
  for (int way = 1; way < {1 << floors}; ++way) {{
    const maskv goes = ((maskv)way & ~forks) == (maskv)0;
    if (!any_lane(goes)) continue;
    band_t other[{prefix}_LEAVES];
    {prefix}_{name}_on(parts, shape, way, &forks, other);
    for (int k = 0; k < {prefix}_LEAVES; ++k)
      of_leaf[k] = band_pick(goes, band_either(of_leaf[k], other[k]), of_leaf[k]);
  }}
}}
"""
