// rays_point.cl: rays from a point source through the film's pixel centres.
//
// provides  first_ray(), RAY_PARAMETERS, RAY_ARGUMENTS
// needs     prelude, ray, film; source_t { at, inside, on }

#define RAY_PARAMETERS
#define RAY_ARGUMENTS

static inline ray_t first_ray(const film_t *film, const source_t *source, int4 tile, int first RAY_PARAMETERS) {
  // Aim from the source at the pixel's centre; where that is the source itself there is no ray
  const real3v toward = film_points(film, tile, first, source->at);
  const realv square = dot3(toward, toward);
  const maskv aims = square > (realv)0;
  const realv scale = aims ? (realv)1 / sqrt(square) : (realv)0;
  const real3v direction = {scale * toward.x, scale * toward.y, aims ? scale * toward.z : (realv)1};

  // The source is one point: the host knows what it lies in and on
  const maskv inside = (maskv)(MASK)source->inside;
  const maskv on = (maskv)(MASK)source->on;
  return new_ray(broadcast3(source->at), direction, inside, on, aims & in_tile(tile, first));
}
