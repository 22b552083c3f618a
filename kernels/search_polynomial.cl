// search_polynomial.cl: the first root of a polynomial along the ray: guess it, prove it, and where that fails walk.
//
// provides  SURFACE(isolate)()
// needs     prelude, functions, search, polynomial_ray, polynomial_bounds, polynomial_walk, of
//           degree 3 or more
//
// On [0, w] a polynomial lies within the range of its Bernstein coefficients there. So all positive proves that there is
// no root, and the polygon that they span crosses zero near the first one. From there Halley's iteration takes two or
// three steps; then f at t, with slope -s, s > 0, proves that what was found is the first root, if
//
//   f > 0 on [0, t - d]                by its Bernstein coefficients
//   f falls on [t - d, t + d]          |f''| <= m on all the ray and m d <= s / 2
//   f changes sign there               s d >= 4 (|f(t)| + 2 noise)
//
// A lane that this does not settle, most of them touching the surface or just missing it, walks.
//
// source    Farouki, The Bernstein polynomial basis: a centennial retrospective, CAGD 29 (2012)

#define GUESSES 4  // Halley's steps before a lane walks
#define UNPROVED (REAL_EPSILON < NUMBER(1e-10) ? 1 : 0)  // of them, not worth a proof in this precision

// Guess and prove, for the lanes of *open; those that are settled leave it.
static inline void SURFACE(guess)(const realv a[SURFACE(DEGREE) + 1], realv noise, maskv *open, root_t *root) {
  root->steps += one_step(*open);
  realv b[SURFACE(DEGREE) + 1];
  SURFACE(bernstein)(a, (realv)1, b);
  realv least = b[0];
#pragma unroll
  for (int i = 1; i <= SURFACE(DEGREE); ++i) least = min_v(least, b[i]);
  *open = *open & not_lane(least > noise);
  if (!any_lane(*open)) return;

  realv bend = (realv)0;  // |f'''| on the ray is at most this
#pragma unroll
  for (int i = 3; i <= SURFACE(DEGREE); ++i) bend += (realv)(real)(i * (i - 1) * (i - 2)) * abs_v(a[i]);

  maskv tries = *open;
  realv t = SURFACE(polygon)(b), f, df, half_ddf;
  SURFACE(jet)(a, t, &f, &df, &half_ddf);
  for (int i = 0; i < GUESSES && any_lane(tries); ++i) {
    root->steps += one_step(tries);

    // Take one of Halley's steps
    const realv inverse = df / (df * df - f * half_ddf);
    const realv h = f * inverse;
    t = min_v((realv)1, max_v((realv)0, t - h));  // no number becomes 0
    SURFACE(jet)(a, t, &f, &df, &half_ddf);
    if (i < UNPROVED) continue;

    // Is the sign change between t - d and t + d the only one there, and will two of Newton's steps be exact?
    const realv s = -df;
    const realv size = abs_v(f);
    const realv d = abs_v(h) + (realv)16 * noise * abs_v(inverse);
    const realv m = (realv)2 * abs_v(half_ddf) + d * bend;
    const maskv isolated = (m * d <= (realv)NUMBER(0.5) * s) & (s * d >= (realv)4 * (size + noise + noise)) &
                           (d <= (realv)NUMBER(0.0625)) & (t + d <= (realv)1);
    const realv curved = m * abs_v(inverse);
    const realv error = (realv)3 * curved * abs_v(h) * (size * abs_v(inverse));  // the first's, squared the second's
    const maskv exact = curved * error * error <= noise * abs_v(inverse);

    // Is there none before?
    SURFACE(bernstein)(a, max_v(t - d, (realv)0), b);
    least = b[0];
#pragma unroll
    for (int j = 1; j <= SURFACE(DEGREE); ++j) least = min_v(least, b[j]);

    const maskv proved = tries & isolated & exact & (least > noise);
    root->t = proved ? t - f * inverse : root->t;
    root->low = proved ? t - d : root->low;
    root->high = proved ? t + d : root->high;
    root->found = root->found | proved;
    tries = tries & not_lane(proved);
  }
  *open = *open & not_lane(root->found);
}

static inline root_t SURFACE(isolate)(search_t search, SURFACE(t) shape, const method_t *method) {
  realv a[SURFACE(DEGREE) + 1];
  maskv known;
  const realv noise = SURFACE(on_unit_ray)(&search, shape, a, &known);
  root_t root = no_root();
  maskv open = search.lanes & known;
  SURFACE(guess)(a, noise, &open, &root);
  maskv passes = search.lanes & known & not_lane(open | root.found);
  if (any_lane(open)) passes = passes | SURFACE(walk)(a, noise, open, &root);
  return SURFACE(on_whole_ray)(&search, root, passes);
}
