// rays_given_solids.cl: rays_given_nested.cl where sets have colours.
//
// provides  first_ray(), RAY_PARAMETERS, RAY_ARGUMENTS        needs  prelude, memory, ray_nested; COLOURS

#define RAY_PARAMETERS                                                                            \
  , global const real *restrict origins, global const real *restrict directions,                  \
      global const real *restrict inside, global const real *restrict on, global const real *restrict solids
#define RAY_ARGUMENTS , origins, directions, inside, on, solids

// The arrays are padded to whole packets. Directions are unit; inside and on hold sets of colours, solids the number of a
// lens for each colour: whole numbers that single precision holds.
static inline ray_t first_ray(const film_t *film, const source_t *source, int4 tile, int first RAY_PARAMETERS) {
  global const real *o = origins + 3 * first;
  global const real *d = directions + 3 * first;
  const real3v origin = {gather(o, 3), gather(o + 1, 3), gather(o + 2, 3)};
  const real3v direction = {gather(d, 3), gather(d + 1, 3), gather(d + 2, 3)};
  const realv number = (realv)(real)first + LANES;
  ray_t ray = new_ray(origin, direction, to_bits(gather(inside + first, 1)), to_bits(gather(on + first, 1)),
                      number < (realv)(real)tile.w);
  for (int colour = 0; colour < COLOURS; ++colour) {
    ray.solids[colour] = to_bits(gather(solids + COLOURS * first + colour, COLOURS));
  }
  return ray;
}
