// rays_given_nested.cl: rays_given.cl where solids may touch or overlap, or their numbers fill no byte.
//
// provides  first_ray(), RAY_PARAMETERS, RAY_ARGUMENTS
// needs     prelude, memory, ray_nested, or ray where the lenses are in a table

#define RAY_PARAMETERS                                                                            \
  , global const real *restrict origins, global const real *restrict directions,                  \
      global const real *restrict inside, global const real *restrict on
#define RAY_ARGUMENTS , origins, directions, inside, on

// The arrays are padded to whole packets. Directions are unit; inside and on hold sets of lenses, or numbers of
// lenses and -1, found by the host: whole numbers that single precision holds.
static inline ray_t first_ray(const film_t *film, const source_t *source, int4 tile, int first RAY_PARAMETERS) {
  global const real *o = origins + 3 * first;
  global const real *d = directions + 3 * first;
  const real3v origin = {gather(o, 3), gather(o + 1, 3), gather(o + 2, 3)};
  const real3v direction = {gather(d, 3), gather(d + 1, 3), gather(d + 2, 3)};
  const realv number = (realv)(real)first + LANES;
  return new_ray(origin, direction, to_bits(gather(inside + first, 1)), to_bits(gather(on + first, 1)),
                 number < (realv)(real)tile.w);
}
