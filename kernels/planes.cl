// planes.cl: the faces of a convex polyhedron, the solid where a x + b y + c z <= d for every plane.
//
// provides  SURFACE(value)(), SURFACE(number_of)(); SURFACE(gradient)(), SURFACE(leaf_gradient)(),
//           SURFACE(leaf_f_gradient)(), SURFACE(hessian)()
// needs     prelude, functions; SURFACE(PLANES), SURFACE(WORDS); SURFACE(t) with planes[], WORDS numbers of each: a, b,
//           c, d of the size max(|a|, |b|, |c|) = 1, d - g and g, see search_planes.cl
//
// The numbers of the planes are arguments, and every loop over them is one in the kernel: a gem of 73 faces compiles as
// fast as a cube.

// a x + b y + c z - d, of another d.
static inline __attribute__((always_inline)) realv SURFACE(value)(const real *plane, real3v p, real d) {
  return (realv)plane[2] * p.z - (realv)d + (realv)plane[1] * p.y + (realv)plane[0] * p.x;
}

// A number of each lane's own plane.
static inline realv SURFACE(number_of)(SURFACE(t) shape, realv leaf, int word) {
  real numbers[VW];
  store_lanes(leaf, numbers);
  for (int i = 0; i < VW; ++i) numbers[i] = shape->planes[SURFACE(WORDS) * (int)numbers[i] + word];
  return load_lanes(numbers);
}

// The outward normal of a face by its number, not unit.
static inline real3v SURFACE(leaf_gradient)(real3v p, SURFACE(t) shape, realv leaf) {
  const real3v normal = {SURFACE(number_of)(shape, leaf, 0), SURFACE(number_of)(shape, leaf, 1),
                         SURFACE(number_of)(shape, leaf, 2)};
  return normal;
}

// A face's own function at a point, negative inside, with its gradient.
static inline realv SURFACE(leaf_f_gradient)(real3v p, SURFACE(t) shape, realv leaf, real3v *gradient) {
  *gradient = SURFACE(leaf_gradient)(p, shape, leaf);
  return dot3(*gradient, p) - SURFACE(number_of)(shape, leaf, 3);
}

// The normal of the face that is nearest to a point on the surface.
static inline real3v SURFACE(gradient)(real3v p, SURFACE(t) shape) {
  realv most = (realv)-REAL_MAX, leaf = (realv)0;
#pragma nounroll
  for (int k = 0; k < SURFACE(PLANES); ++k) {
    const real *plane = shape->planes + SURFACE(WORDS) * k;
    const realv value = SURFACE(value)(plane, p, plane[3]);
    leaf = value > most ? (realv)k : leaf;
    most = max_v(most, value);
  }
  return SURFACE(leaf_gradient)(p, shape, leaf);
}

// The same with the second derivatives, which are none.
static inline void SURFACE(hessian)(real3v p, SURFACE(t) shape, real3v *gradient, realv h[6]) {
  *gradient = SURFACE(gradient)(p, shape);
  for (int i = 0; i < 6; ++i) h[i] = (realv)0;
}
