// root_corrected.cl: isolate the first root, then correct it by F itself.
//
// provides  SURFACE(first_root)()        needs  prelude, functions, search, SURFACE(isolate), SURFACE(f_gradient)
//
// For roots that are as good as the polynomial along the ray, whose coefficients carry the rounding of all the ray's
// length. F at the point is better: Newton's steps, mostly one, as long as they stay in the bracket.

#define CORRECTIONS 8                       // more only where rounding moves t
#define CORRECTED sqrt((real)REAL_EPSILON)  // of t: the step after one so short would be rounding's

static inline root_t SURFACE(first_root)(search_t search, SURFACE(t) shape, const method_t *method) {
  root_t root = SURFACE(isolate)(search, shape, method);
  maskv moves = root.found;
  for (int i = 0; i < CORRECTIONS && any_lane(moves); ++i) {
    root.steps += one_step(moves);
    real3v gradient;
    const realv f = SURFACE(f_gradient)(at3(search.origin, search.direction, root.t), shape, &gradient);
    const realv step = f / dot3(gradient, search.direction);
    const realv t = root.t - step;
    const maskv within = (t > root.low) & (t < root.high);
    root.t = (moves & within) ? t : root.t;
    moves = moves & within & (abs_v(step) > (realv)CORRECTED * t);
  }
  return root;
}
