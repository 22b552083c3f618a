// polynomial_ray.cl: a polynomial surface along the ray.
//
// provides  SURFACE(rounding)(), SURFACE(in_range)(), SURFACE(on_ray)(), SURFACE(on_unit_ray)(), SURFACE(on_whole_ray)();
// needs     prelude, search; SURFACE(along), the coefficients of F(o + t d); SURFACE(magnitude), F with all its terms
//           positive; SURFACE(DEGREE), 2 or more; SURFACE(ROUNDINGS), how many of them an error of F adds up

// A bound of roundings above this could be that of values which are none, or whose products are none
#define MOST_NOISE (REAL_MAX * REAL_EPSILON * REAL_EPSILON)

// The bound of the rounding of F(o + t d), and of the sum of what its powers of t round, for t in [0, length].
static inline realv SURFACE(rounding)(real3v o, real3v d, realv length, SURFACE(t) shape) {
  const real3v reach = {abs_v(o.x) + abs_v(length * d.x), abs_v(o.y) + abs_v(length * d.y),
                        abs_v(o.z) + abs_v(length * d.z)};
  return (realv)(REAL_EPSILON * SURFACE(ROUNDINGS)) * SURFACE(magnitude)(reach, shape);
}

// Whether a value and the bound of its rounding say anything: no part was flushed to zero that mattered, none overflowed.
static inline maskv SURFACE(in_range)(realv value, realv noise) {
  return (noise > (realv)(REAL_TINY / REAL_EPSILON)) & (value < (realv)MOST_NOISE);
}

// Write F along the ray, positive on the ray's side, into a: the coefficients of t, which is in units of the ray's length,
// for powers of a direction leave the range of numbers where a length as small or large does not. A known root at 0 is
// divided out. Returns the bound of the rounding of f on [0, 1].
static inline realv SURFACE(on_ray)(const search_t *search, SURFACE(t) shape, realv a[SURFACE(DEGREE) + 1]) {
  realv c[SURFACE(DEGREE) + 1];
  const real3v way = {search->direction.x * search->length, search->direction.y * search->length,
                      search->direction.z * search->length};
  SURFACE(along)(search->origin, way, shape, c);
  const realv side = search->inside ? (realv)-1 : (realv)1;
#pragma unroll
  for (int i = 0; i < SURFACE(DEGREE); ++i) a[i] = side * (search->departs ? c[i + 1] : c[i]);
  a[SURFACE(DEGREE)] = search->departs ? (realv)0 : side * c[SURFACE(DEGREE)];

  return SURFACE(rounding)(search->origin, search->direction, search->length, shape);
}

// The same with the noise's power of two as the unit of f, so that squares stay within the range of numbers. Lanes whose
// coefficients may not have done so are left out of *known; so are those where what was flushed to zero might matter
// beside the noise.
static inline realv SURFACE(on_unit_ray)(const search_t *search, SURFACE(t) shape, realv a[SURFACE(DEGREE) + 1],
                                         maskv *known) {
  const realv noise = SURFACE(on_ray)(search, shape, a);
  *known = (noise > (realv)(REAL_TINY / REAL_EPSILON)) & (noise < (realv)MOST_NOISE);
  const realv scale = down_scale(noise);
#pragma unroll
  for (int i = 0; i <= SURFACE(DEGREE); ++i) a[i] *= scale;
  return noise * scale;
}

// Give a root on [0, 1] the ray's own units. Lanes that neither found one nor pass are undecided; a ray inside cannot pass.
static inline root_t SURFACE(on_whole_ray)(const search_t *search, root_t root, maskv passes) {
  root.undecided = search->lanes & not_lane(root.found) & (search->inside | not_lane(passes));
  root.t = max_v(root.t, (realv)0) * search->length;
  root.low = max_v(root.low, (realv)0) * search->length;
  root.high = root.high * search->length;
  return root;
}
