// ends_map.cl: what is kept of a ray that is to be painted: where it landed, how it ended, how many surfaces it met.
//
// provides  store_end(), END_PARAMETERS, END_ARGUMENTS        needs  prelude, ray, screen

#define END_PARAMETERS global real *restrict st, global uchar *restrict status, global uchar *restrict events
#define END_ARGUMENTS st, status, events

// The arrays hold (pixels, 2) numbers and (pixels) bytes, padded to whole packets; first is the packet's first pixel.
static inline void store_end(const ray_t *ray, place_t place, int first, END_PARAMETERS) {
  store_pairs(place.s, place.t, st + 2 * first);
  store_bytes(ray->status, status + first);
  store_bytes(ray->events, events + first);
}
