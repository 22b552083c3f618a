// newton.cl: polish a bracketed root.
//
// provides  SURFACE(polish)()        needs  prelude, search, SURFACE(f_gradient)
// source    Press et al., Numerical Recipes, 3rd ed., sec. 9.4: Newton's method kept inside its bracket

#ifndef POLISH_LIMIT
#define POLISH_LIMIT 100  // twice what halving a bracket of one step to the last bit of a double takes
#endif

// Returns the place in [low, high] where side * F falls through zero. Departing lanes look for a root of
// (F - f_start) / t instead, which has lost the root at 0.
//
//   side        +1 where F > 0 before the root, -1 inside       low, high  side * F >= 0 at low, < 0 at high
//   f_start     F at t = 0, rounding's share of the known root  tolerance  a shorter move of t ends the search
static inline realv SURFACE(polish)(search_t search, SURFACE(t) shape, realv side, realv f_start, maskv divides,
                                    realv low, realv high, realv tolerance, maskv lanes) {
  realv t = (low + high) * (realv)NUMBER(0.5);
  maskv moves = lanes;
  for (int i = 0; i < POLISH_LIMIT && any_lane(moves); ++i) {
    // Take the value and slope along the ray, without the known root
    real3v gradient;
    const realv f = SURFACE(f_gradient)(at3(search.origin, search.direction, t), shape, &gradient);
    const realv value_f = side * (f - f_start);
    const realv slope_f = side * dot3(gradient, search.direction);
    const realv value = divides ? value_f / t : value_f;
    const realv slope = divides ? (slope_f - value) / t : slope_f;

    // Shrink the bracket; the root lies before a negative value
    const maskv before = value < (realv)0;
    high = before ? t : high;
    low = before ? low : t;

    // Step by Newton, or to the middle where that leaves the bracket or is no number
    const realv newton = t - value / slope;
    const realv middle = (low + high) * (realv)NUMBER(0.5);
    const maskv ends = (abs_v(newton - t) <= tolerance) | (value == (realv)0);
    const maskv within = (newton > low) & (newton < high);
    const realv next = within ? newton : ends ? t : middle;
    t = moves ? next : t;
    moves = moves & not_lane(ends);
  }
  return t;
}
