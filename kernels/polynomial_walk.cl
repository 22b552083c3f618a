// polynomial_walk.cl: to the first root of a polynomial along the ray, never stepping past it.
//
// provides  SURFACE(walk)()        needs  prelude, functions, search, polynomial_bounds
//
// Guarded Newton. With f'' >= -m on all that lies ahead,
//
//   f(t + h) >= f - s h - m h^2 / 2,   s = -f'(t),   which is positive up to   h = 2 f / (s + sqrt(s^2 + 2 f m)),
//
// so a step of h passes no root, and near a simple one it is Newton's own. The bounds of f'' come from its Bernstein
// coefficients on what is left of the ray, a range that shrinks with every step. Where f has fallen below the bound of
// its own rounding, a crossing is proved if the slope there is more than that rounding and the curvature can undo;
// where it is not, the ray is undecided. Curvature of either sign: where f bends down there is a crossing for certain,
// but Newton's step to it from a slope near zero goes anywhere.
//
// source    Kalra & Barr, Guaranteed ray intersections with implicit surfaces, SIGGRAPH 1989

#ifndef STEP_LIMIT
#define STEP_LIMIT 200  // a touch within rounding takes about 60; what takes more is undecided
#endif

// Walk to the first root, for the lanes of open. Returns the lanes of them that provably have none.
static inline maskv SURFACE(walk)(const realv a[SURFACE(DEGREE) + 1], realv noise, maskv open, root_t *root) {
  maskv passes = (maskv)0, steps = open;
  realv t = (realv)0;
  for (int i = 0; i < STEP_LIMIT && any_lane(steps); ++i) {
    root->steps += one_step(steps);

    // See f, its slope and the bounds of its curvature ahead
    realv s[SURFACE(DEGREE) + 1], low, high;
    SURFACE(recentre)(a, t, s);
    SURFACE(curvature)(s, (realv)1 - t, &low, &high);
    const realv f = max_v(s[0], (realv)0);
    const realv falls = -s[1];
    const realv m = max_v(-low, (realv)0);

    // Arrived where f may be zero: is it a crossing?
    const maskv arrives = s[0] <= noise;
    const realv within = (realv)2 * (abs_v(s[0]) + noise) / falls;  // a crossing lies so near
    const realv bend = max_v(high, m);
    const maskv crosses =
        (falls > (realv)0) & (falls * falls > (realv)4 * noise * bend) & (t + within <= (realv)1);
    const maskv found = steps & arrives & crosses;
    root->t = found ? t + s[0] / falls : root->t;
    root->low = found ? t - within : root->low;
    root->high = found ? t + within : root->high;
    root->found = root->found | found;

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
  root->t = (open & not_lane(root->found)) ? t : root->t;
  return passes;
}
