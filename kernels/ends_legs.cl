// ends_legs.cl: what is kept of a ray whose last straight leg is wanted, too: three times the memory of a map.
//
// provides  store_end(), END_PARAMETERS, END_ARGUMENTS        needs  prelude, ray, screen

#define END_PARAMETERS                                                                                       \
  global real *restrict st, global uchar *restrict status, global uchar *restrict events,                    \
      global real *restrict origin, global real *restrict direction
#define END_ARGUMENTS st, status, events, origin, direction

// The arrays hold (pixels, 2), (pixels, 3) numbers and (pixels) bytes, padded to whole packets.
static inline void store_end(const ray_t *ray, place_t place, int first, END_PARAMETERS) {
  store_pairs(place.s, place.t, st + 2 * first);
  store_bytes(ray->status, status + first);
  store_bytes(ray->events, events + first);
  scatter(ray->origin.x, origin + 3 * first, 3);
  scatter(ray->origin.y, origin + 3 * first + 1, 3);
  scatter(ray->origin.z, origin + 3 * first + 2, 3);
  scatter(ray->direction.x, direction + 3 * first, 3);
  scatter(ray->direction.y, direction + 3 * first + 1, 3);
  scatter(ray->direction.z, direction + 3 * first + 2, 3);
}
