// search_polynomial.cl: the first root of a polynomial along the ray, never stepping past it.
//
// provides  SURFACE(first_root)()
// needs     prelude, search; SURFACE(along), the coefficients of F(o + t d); SURFACE(magnitude), F with all its terms
//           positive; SURFACE(DEGREE), 2 or more; SURFACE(ROUNDINGS), how many of them an error of F adds up
//
// Guarded Newton. Let f be F on the ray's side, f > 0 before the first root. With f'' >= -m on all that lies ahead,
//
//   f(t + h) >= f - s h - m h^2 / 2,   s = -f'(t),   which is positive up to   h = 2 f / (s + sqrt(s^2 + 2 f m)),
//
// so a step of h passes no root, and near a simple one it is Newton's own. The bounds of f'' come from its Bernstein
// coefficients on what is left of the ray, a range that shrinks with every step. Where f has fallen below the bound of
// its own rounding, a crossing is proved if the slope there is more than that rounding and the curvature can undo;
// where it is not, the ray is undecided.
//
// source    Kalra & Barr, Guaranteed ray intersections with implicit surfaces, SIGGRAPH 1989, for the guard; Farouki,
//           The Bernstein polynomial basis: a centennial retrospective, CAGD 29 (2012), for the bounds

#ifndef STEP_LIMIT
#define STEP_LIMIT 200  // a touch within rounding takes about 60; what takes more is undecided
#endif

// Write F along the ray on [0, 1], positive on the ray's side, into a. A known root at 0 is divided out.
// Returns the bound of the rounding of f.
static inline realv SURFACE(on_ray)(const search_t *search, SURFACE(t) shape, realv a[SURFACE(DEGREE) + 1]) {
  realv c[SURFACE(DEGREE) + 1];
  SURFACE(along)(search->origin, search->direction, shape, c);
  realv scale = search->inside ? (realv)-1 : (realv)1;
#pragma unroll
  for (int i = 0; i <= SURFACE(DEGREE); ++i) {
    c[i] *= scale;
    scale *= search->length;
  }
#pragma unroll
  for (int i = 0; i < SURFACE(DEGREE); ++i) a[i] = search->departs ? c[i + 1] : c[i];
  a[SURFACE(DEGREE)] = search->departs ? (realv)0 : c[SURFACE(DEGREE)];

  const real3v reach = {abs_v(search->origin.x) + abs_v(search->direction.x) * search->length,
                        abs_v(search->origin.y) + abs_v(search->direction.y) * search->length,
                        abs_v(search->origin.z) + abs_v(search->direction.z) * search->length};
  return (realv)(REAL_EPSILON * SURFACE(ROUNDINGS)) * SURFACE(magnitude)(reach, shape);
}

// Recentre at t: s[k] = f^(k)(t) / k!.
static inline void SURFACE(recentre)(const realv a[SURFACE(DEGREE) + 1], realv t, realv s[SURFACE(DEGREE) + 1]) {
#pragma unroll
  for (int i = 0; i <= SURFACE(DEGREE); ++i) s[i] = a[i];
#pragma unroll
  for (int k = 0; k < SURFACE(DEGREE); ++k) {
#pragma unroll
    for (int i = SURFACE(DEGREE) - 1; i >= k; --i) s[i] += t * s[i + 1];
  }
}

// Bound f'' on the rest of the ray, of length rest in t: its Bernstein coefficients, by sums of its scaled powers.
static inline void SURFACE(curvature)(const realv s[SURFACE(DEGREE) + 1], realv rest, realv *low, realv *high) {
  realv b[SURFACE(DEGREE) - 1];
  realv power = (realv)1;
  real weight = 2;  // (j + 2)(j + 1) / binomial(DEGREE - 2, j)
#pragma unroll
  for (int j = 0; j < SURFACE(DEGREE) - 1; ++j) {
    b[j] = (realv)weight * power * s[j + 2];
    power *= rest;
    if (j < SURFACE(DEGREE) - 2) weight *= (real)(j + 3) / (real)(SURFACE(DEGREE) - 2 - j);
  }
#pragma unroll
  for (int pass = 1; pass < SURFACE(DEGREE) - 1; ++pass) {
#pragma unroll
    for (int j = SURFACE(DEGREE) - 2; j >= pass; --j) b[j] += b[j - 1];
  }
  *low = *high = b[0];
#pragma unroll
  for (int j = 1; j < SURFACE(DEGREE) - 1; ++j) {
    *low = min_v(*low, b[j]);
    *high = max_v(*high, b[j]);
  }
}

static inline root_t SURFACE(first_root)(search_t search, SURFACE(t) shape, const method_t *method) {
  realv a[SURFACE(DEGREE) + 1];
  const realv noise = SURFACE(on_ray)(&search, shape, a);

  root_t root;
  root.found = (maskv)0;
  root.t = (realv)0;
  maskv passes = (maskv)0, steps = search.lanes;
  realv t = (realv)0;
  for (int i = 0; i < STEP_LIMIT && any_lane(steps); ++i) {
    // See f, its slope and the bounds of its curvature ahead
    realv s[SURFACE(DEGREE) + 1], low, high;
    SURFACE(recentre)(a, t, s);
    SURFACE(curvature)(s, (realv)1 - t, &low, &high);
    const realv f = max_v(s[0], (realv)0);
    const realv falls = -s[1];
    const realv m = max_v(-low, (realv)0);

    // Arrived where f may be zero: is it a crossing?
    const maskv arrives = s[0] <= noise;
    const maskv crosses = (falls > (realv)0) & (falls * falls > (realv)4 * noise * high);
    const maskv found = steps & arrives & crosses;
    root.t = found ? t + s[0] / falls : root.t;
    root.found = root.found | found;

    // Step as far as no root can be, in the form that does not cancel
    const realv reach = sqrt(falls * falls + (realv)2 * f * m);
    const realv above = falls > (realv)0 ? f + f : reach - falls;
    const realv below = falls > (realv)0 ? falls + reach : m;
    const realv next = t + above / below;
    const maskv leaves = not_lane(next < (realv)1) & not_lane(arrives);  // also where nothing ahead bends down: 1 / 0
    passes = passes | (steps & leaves);
    steps = steps & not_lane(arrives | leaves);
    t = steps ? next : t;
  }

  // A ray inside must come out
  root.undecided = search.lanes & not_lane(root.found) & (search.inside | not_lane(passes));
  root.t = max_v(root.found ? root.t : t, (realv)0) * search.length;
  return root;
}
