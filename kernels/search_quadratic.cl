// search_quadratic.cl: the first root of a quadric along the ray, in closed form.
//
// provides  SURFACE(isolate)()        needs  prelude, functions, search, polynomial_ray, of degree 2
//
// f(t) = a0 + a1 t + a2 t^2, positive before the first root, t in units of the ray's length. With s = -a1 and m = -2 a2
// that is where the larger of 2 a0 / (s + sqrt(s^2 + 2 a0 m)) and (sqrt(s^2 + 2 a0 m) - s) / m does not cancel. The errors
// of the three coefficients add up to `noise` at most, which leaves the discriminant uncertain by noise times the largest
// of 2 |a1|, 4 |a0| and 4 |a2|, and a little for terms of second order: what lies within is a touch or none, undecided.

static inline root_t SURFACE(isolate)(search_t search, SURFACE(t) shape, const method_t *method) {
  realv a[3];
  const realv noise = SURFACE(on_ray)(&search, shape, a);
  const realv f = max_v(a[0], (realv)0);
  const realv s = -a[1];
  const realv m = (realv)-2 * a[2];
  const realv square = s * s + (realv)2 * f * m;

  // Solve in the form that does not cancel; the root is no number where there is none
  const realv reach = sqrt(square);
  const maskv falls = s > (realv)0;
  const realv above = falls ? f + f : reach - s;
  const realv below = falls ? s + reach : m;
  const realv t = above / below;

  // Are there roots?
  const realv largest = max_v(max_v(abs_v(s), f + f), abs_v(m));
  const realv doubt = (realv)NUMBER(2.5) * noise * largest;
  const maskv known = (noise > (realv)(REAL_TINY / REAL_EPSILON)) & (doubt > (realv)REAL_TINY) & (doubt < (realv)MOST_NOISE);
  const maskv crosses = known & (square > doubt);
  const maskv never = known & ((square < -doubt) | ((s <= (realv)0) & (m <= (realv)0)));

  // A start within rounding of the surface must fall through it, and none is on the other side; a ray inside must come out
  const maskv starts = (a[0] > noise) | (falls & (a[0] >= -noise));
  const maskv ahead = (below > (realv)0) & (t < (realv)1);
  root_t root = no_root();
  root.steps = one_step(search.lanes);
  root.found = search.lanes & starts & crosses & ahead & not_lane(never);
  const maskv passes = starts & (never | (crosses & not_lane(ahead)));
  root.undecided = search.lanes & not_lane(root.found) & (search.inside | not_lane(passes));
  root.t = root.low = root.high = root.found ? t * search.length : (realv)0;
  return root;
}
