// rays_given.cl: rays that the caller gives, three numbers a point.
//
// provides  first_ray(), RAY_PARAMETERS, RAY_ARGUMENTS
// needs     prelude, memory, ray

#define RAY_PARAMETERS                                                                            \
  , global const real *restrict origins, global const real *restrict directions,                  \
      global const char *restrict inside, global const char *restrict on
#define RAY_ARGUMENTS , origins, directions, inside, on

// The arrays are padded to whole packets. Directions are unit; inside and on hold a lens number or -1, found by the host.
static inline ray_t first_ray(const film_t *film, const source_t *source, int4 tile, int first RAY_PARAMETERS) {
  global const real *o = origins + 3 * first;
  global const real *d = directions + 3 * first;
  const real3v origin = {gather(o, 3), gather(o + 1, 3), gather(o + 2, 3)};
  const real3v direction = {gather(d, 3), gather(d + 1, 3), gather(d + 2, 3)};
  const realv number = (realv)(real)first + LANES;
  return new_ray(origin, direction, load_bytes(inside + first), load_bytes(on + first),
                 number < (realv)(real)tile.w);
}
