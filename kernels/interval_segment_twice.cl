// interval_segment_twice.cl: the parts of F on a segment of the ray, computed in twice the precision.
//
// provides  SURFACE(on_segment)()        needs  prelude, functions, interval, search, double_double; SURFACE(parts_twice)()
//
// Near a touch a part's value and slope cancel, and the roundings of all its terms are what leaves a ray undecided in
// double. Here only those are left that the ray brings with it, from its way into the lens's space.

static inline dd_t SURFACE(place_twice)(realv o, dd_t d, realv t) { return dd_add(dd_of(o), dd_multiply(d, dd_of(t))); }

// From mid - half_length to mid + half_length, in units of the ray's length.
static inline SURFACE(parts_t) SURFACE(on_segment)(const search_t *search, realv mid, realv half_length, SURFACE(t) shape) {
  const real3v o = search->origin;
  const dd3_t d = {dd_product(search->direction.x, search->length), dd_product(search->direction.y, search->length),
                   dd_product(search->direction.z, search->length)};
  const dd3_t middle = {SURFACE(place_twice)(o.x, d.x, mid), SURFACE(place_twice)(o.y, d.y, mid),
                        SURFACE(place_twice)(o.z, d.z, mid)};
  const dd_t share = dd_of(half_length);
  const dd3_t along = {dd_multiply(d.x, share), dd_multiply(d.y, share), dd_multiply(d.z, share)};
  const real3v drift = {ROUNDING * (abs_v(o.x) + (realv)2 * abs_v(d.x.high)),
                        ROUNDING * (abs_v(o.y) + (realv)2 * abs_v(d.y.high)),
                        ROUNDING * (abs_v(o.z) + (realv)2 * abs_v(d.z.high))};
  const real3v reach = {(abs_v(middle.x.high) + abs_v(along.x.high)) * WIDEN + drift.x,
                        (abs_v(middle.y.high) + abs_v(along.y.high)) * WIDEN + drift.y,
                        (abs_v(middle.z.high) + abs_v(along.z.high)) * WIDEN + drift.z};
  return SURFACE(parts_twice)(middle, along, reach, drift, shape);
}
