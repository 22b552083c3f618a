// search_march.cl: the first root by a march of fixed steps.
//
// provides  SURFACE(isolate)()        needs  prelude, functions, search; SURFACE(f); method_t { step }
//
// The baseline. Two crossings within one step pass unseen; a chord that starts on the surface does not, since its first
// crossing is known to be there. Side and known root come from the event that started the search, never from F at a
// small distance.

static inline root_t SURFACE(isolate)(search_t search, SURFACE(t) shape, const method_t *method) {
  // See F as positive on the ray's side. On the surface it is zero but for rounding, which is taken off
  const realv side = search.inside ? (realv)-1 : (realv)1;
  const realv f_0 = SURFACE(f)(search.origin, shape);
  const realv f_start = search.departs ? f_0 : (realv)0;

  // March until F changes sign, the box ends, or F is no number
  realv steps = (realv)0, low = (realv)0, t = (realv)0, value = (realv)0;
  maskv marches = search.lanes;
  root_t root = no_root();
  while (any_lane(marches)) {
    root.steps += one_step(marches);
    steps += (realv)1;
    const realv next = min_v(steps * (realv)method->step, search.length);
    low = marches ? t : low;
    t = marches ? next : t;
    const realv f = side * (SURFACE(f)(at3(search.origin, search.direction, t), shape) - f_start);
    value = marches ? f : value;
    marches = marches & (f >= (realv)0) & (t < search.length);
  }

  // Between the last two samples there is a root where the sign changed; a ray inside must find one
  root.found = search.lanes & (value < (realv)0);
  root.undecided = search.lanes & not_lane(root.found) & (search.inside | (value != value));
  root.t = root.undecided ? low : (realv)NUMBER(0.5) * (low + t);
  root.low = low;
  root.high = t;
  return root;
}
