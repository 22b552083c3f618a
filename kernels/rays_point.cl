// rays_point.cl: rays from a point source through the film's pixel centres.
//
// provides  first_ray(), RAY_PARAMETERS, RAY_ARGUMENTS
// needs     prelude, ray, film; source_t { at, inside, on }

#define RAY_PARAMETERS
#define RAY_ARGUMENTS

static inline ray_t first_ray(const film_t *film, const source_t *source, int4 tile, int first RAY_PARAMETERS) {
  const realv pixel = (realv)(real)first + LANES;

  // Aim from the source at the pixel's centre; where that is the source itself there is no ray
  const real3v origin = broadcast3(source->at);
  const real3v toward = at3(film_points(film, tile, pixel), origin, (realv)-1);
  const maskv aims = dot3(toward, toward) > (realv)0;
  const real3v ahead = {(realv)0, (realv)0, (realv)1};
  const real3v direction = unit3(pick3(aims, toward, ahead));

  // The source is one point: the host knows what it lies in and on
  const maskv inside = (maskv)(MASK)source->inside;
  const maskv on = (maskv)(MASK)source->on;
  return new_ray(origin, direction, inside, on, aims & (pixel < (realv)(real)tile.w));
}
