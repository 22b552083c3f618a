// search_guarded.cl: the first root of a polynomial along the ray by a walk alone.
//
// provides  SURFACE(isolate)()        needs  prelude, functions, search, polynomial_ray, polynomial_bounds, polynomial_walk
static inline root_t SURFACE(isolate)(search_t search, SURFACE(t) shape, const method_t *method) {
  realv a[SURFACE(DEGREE) + 1];
  maskv known;
  const realv noise = SURFACE(on_unit_ray)(&search, shape, a, &known);
  root_t root = no_root();
  const maskv passes = SURFACE(walk)(a, noise, search.lanes & known, &root);
  return SURFACE(on_whole_ray)(&search, root, passes);
}
