// lens_coat_planes.cl: which face of a convex polyhedron a point is nearest to, of the mirrored ones and of the others.
//
// provides  LENS(coat)()        needs  prelude, coats, planes; LENS(coated_planes)[], generated: 1 for a mirrored plane
// set by    the generated assembly: as for lens.cl

static inline coat_t LENS(coat)(real3v p, SURFACE(t) shape) {
  coat_t at;
  at.coat = at.rest = (realv)-REAL_MAX;
  realv coat_leaf = (realv)0, rest_leaf = (realv)0;
#pragma nounroll
  for (int k = 0; k < SURFACE(PLANES); ++k) {
    const real *plane = shape->planes + SURFACE(WORDS) * k;
    const realv value = SURFACE(value)(plane, p, plane[3]);
    if (LENS(coated_planes)[k]) {
      coat_leaf = value > at.coat ? (realv)k : coat_leaf;
      at.coat = max_v(at.coat, value);
    } else {
      rest_leaf = value > at.rest ? (realv)k : rest_leaf;
      at.rest = max_v(at.rest, value);
    }
  }
  at.coat_gradient = SURFACE(leaf_gradient)(p, shape, coat_leaf);
  at.rest_gradient = SURFACE(leaf_gradient)(p, shape, rest_leaf);
  return at;
}
