// interval_segment.cl: the parts of F on a segment of the ray.
//
// provides  SURFACE(on_segment)()        needs  prelude, functions, interval, search; SURFACE(parts)()

// From mid - half_length to mid + half_length, in units of the ray's length.
static inline SURFACE(parts_t) SURFACE(on_segment)(const search_t *search, realv mid, realv half_length, SURFACE(t) shape) {
  const real3v o = search->origin;
  const real3v d = {search->direction.x * search->length, search->direction.y * search->length,
                    search->direction.z * search->length};
  const real3v drift = {coordinate_error(o.x, d.x), coordinate_error(o.y, d.y), coordinate_error(o.z, d.z)};
  const real3v middle = at3(o, d, mid);
  const real3v along = {half_length * d.x, half_length * d.y, half_length * d.z};
  const real3v reach = {abs_v(middle.x) + abs_v(along.x) + drift.x, abs_v(middle.y) + abs_v(along.y) + drift.y,
                        abs_v(middle.z) + abs_v(along.z) + drift.z};
  return SURFACE(parts)(middle, along, reach, drift, shape);
}
