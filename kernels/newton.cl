// newton.cl: polish a bracketed root.
//
// provides  SURFACE(polish)()        needs  prelude, functions, search, SURFACE(leaf_f_gradient)
// source    Press et al., Numerical Recipes, 3rd ed., sec. 9.4: Newton's method kept inside its bracket

#ifndef POLISH_LIMIT
#define POLISH_LIMIT 100  // twice what halving a bracket of one step to the last bit of a double takes
#endif
#define NEWTON_NEAR sqrt((real)REAL_EPSILON)  // of t: a move so short is followed by one of rounding's size, or by noise

// Moves the roots that were found to where F changes its sign in their brackets. A departing lane whose bracket starts at
// the known root looks for one of (F - F(0)) / t instead, which has lost that root; F(0) is no more than rounding.
//
//   tolerance  a shorter move of t ends the search, as one of two roundings does
static inline void SURFACE(polish)(search_t search, SURFACE(t) shape, realv tolerance, root_t *root) {
  const realv side = search.inside ? (realv)-1 : (realv)1;
  const maskv divides = root->found & search.departs & (root->low == (realv)0);
  realv f_start = (realv)0;
  if (any_lane(divides)) {
    real3v unused;
    f_start = divides ? SURFACE(leaf_f_gradient)(search.origin, shape, root->leaf, &unused) : (realv)0;
  }
  realv low = root->low, high = root->high;
  const realv finest = max_v(tolerance, (realv)REAL_EPSILON * high);
  const realv small = (realv)NEWTON_NEAR * high;
  realv last = (realv)0;  // move of t by Newton's method, 0 where the one before was none
  realv t = root->t;
  const realv fine = (realv)4 * finest;  // a bracket: F says no more in it
  maskv moves = root->found & (high - low > fine);
  for (int i = 0; i < POLISH_LIMIT && any_lane(moves); ++i) {
    root->steps += one_step(moves);

    // Take the value and slope along the ray, without the known root
    real3v gradient;
    const realv f = SURFACE(leaf_f_gradient)(at3(search.origin, search.direction, t), shape, root->leaf, &gradient);
    realv value = side * (f - f_start);
    realv slope = side * dot3(gradient, search.direction);
    if (any_lane(divides)) {
      value = divides ? value / t : value;
      slope = divides ? (slope - value) / t : slope;
    }

    // Shrink the bracket; the root lies before a negative value
    const maskv before = value < (realv)0;
    high = before ? t : high;
    low = before ? low : t;

    // Step by Newton, or to the middle where that leaves the bracket or is no number
    const realv newton = t - value / slope;
    const realv middle = (low + high) * (realv)NUMBER(0.5);
    const maskv within = (newton > low) & (newton < high);
    const realv move = abs_v(newton - t);

    // Be done where move or bracket is fine, where the next move, as moves shrink (move / last)^2 move, will be far
    // finer, and where only rounding moves t any more. A first move tells neither
    const maskv settles = within & (last > (realv)0) &  //
                          (((realv)64 * move * move * move <= finest * last * last) | ((move >= last) & (move <= small)));
    const maskv ends = (move <= finest) | (high - low <= fine) | (value == (realv)0) | settles;
    const realv next = within ? newton : ends ? t : middle;
    t = moves ? next : t;
    last = within ? move : (realv)0;
    moves = moves & not_lane(ends);
  }
  root->t = t;
}
