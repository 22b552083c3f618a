// root_corrected.cl: isolate the first root, then correct it once by F itself.
//
// provides  SURFACE(first_root)()        needs  prelude, search, SURFACE(isolate), SURFACE(f_gradient)
//
// For roots that are as good as the polynomial along the ray, whose coefficients carry the rounding of all the ray's
// length. F at the point is better: one step of Newton's, unless it leaves the bracket.
static inline root_t SURFACE(first_root)(search_t search, SURFACE(t) shape, const method_t *method) {
  root_t root = SURFACE(isolate)(search, shape, method);
  if (!any_lane(root.found)) return root;
  real3v gradient;
  const realv f = SURFACE(f_gradient)(at3(search.origin, search.direction, root.t), shape, &gradient);
  const realv t = root.t - f / dot3(gradient, search.direction);
  root.t = (root.found & (t > root.low) & (t < root.high)) ? t : root.t;
  return root;
}
