// root_mixed.cl: isolate the first root in single precision, polish it in double.
//
// provides  SURFACE(first_root)()
// needs     prelude, search and SURFACE(isolate) in single; mixed, newton; single_method(), SURFACE(single_shape)()
//
// Ray and lens are rounded on their way to single, each of their numbers by half an ulp. The methods count that among
// their roundings (INPUT_ROUNDINGS), so what they prove holds for ray and lens as they are.
static inline root_t SURFACE(first_root)(search_t search, SURFACE(t) shape, const method_t *method) {
  single_search_t rounded;
  rounded.origin = single_vector(search.origin);
  rounded.direction = single_vector(search.direction);
  rounded.length = to_single(search.length);
  rounded.inside = single_lanes(search.inside);
  rounded.departs = single_lanes(search.departs);
  rounded.lanes = single_lanes(search.lanes);
  const single_method_t rounded_method = single_method(method);
  const single_root_t isolated = SURFACE(single_isolate)(rounded, SURFACE(single_shape)(shape), &rounded_method);

  root_t root;
  root.t = to_double(isolated.t);
  root.low = to_double(isolated.low);
  root.high = to_double(isolated.high);
  root.found = double_lanes(isolated.found);
  root.undecided = double_lanes(isolated.undecided);
  root.leaf = to_double(isolated.leaf);
  root.steps = double_lanes(isolated.steps);
  if (any_lane(root.found)) SURFACE(polish)(search, shape, SURFACE(TOLERANCE), &root);
  return root;
}
