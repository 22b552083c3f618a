// root_isolated.cl: take the root as it was isolated, for methods that leave nothing to polish.
//
// provides  SURFACE(first_root)()        needs  prelude, search, SURFACE(isolate)
static inline root_t SURFACE(first_root)(search_t search, SURFACE(t) shape, const method_t *method) {
  return SURFACE(isolate)(search, shape, method);
}
