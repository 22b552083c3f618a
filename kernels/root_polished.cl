// root_polished.cl: isolate the first root, then polish it.
//
// provides  SURFACE(first_root)()
// needs     prelude, search, newton, SURFACE(isolate); SURFACE(TOLERANCE), what method says of it
static inline root_t SURFACE(first_root)(search_t search, SURFACE(t) shape, const method_t *method) {
  root_t root = SURFACE(isolate)(search, shape, method);
  if (any_lane(root.found)) SURFACE(polish)(search, shape, SURFACE(TOLERANCE), &root);
  return root;
}
