// rays_parallel_nested.cl: rays_parallel.cl where solids may touch or overlap.
//
// provides  first_ray(), RAY_PARAMETERS, RAY_ARGUMENTS
// needs     prelude, ray_nested, film; source_t { direction, plane }

#define RAY_PARAMETERS
#define RAY_ARGUMENTS

// The rays start on the plane  direction . p = plane,  which the host lays on the source side of everything: in no solid.
static inline ray_t first_ray(const film_t *film, const source_t *source, int4 tile, int first RAY_PARAMETERS) {
  const real nowhere[3] = {0, 0, 0};
  const real3v target = film_points(film, tile, first, nowhere);
  const real3v direction = broadcast3(source->direction);
  const real3v origin = at3(target, direction, (realv)source->plane - dot3(direction, target));
  return new_ray(origin, direction, (maskv)0, (maskv)0, in_tile(tile, first));
}
