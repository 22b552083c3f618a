// parks_never.cl: every packet is followed to its last ray's end.
//
// provides  next_ray(), parks(), PARK_PARAMETERS, PARK_ARGUMENTS
// needs     ray, layer, first_ray(), start()

#define PARK_PARAMETERS
#define PARK_ARGUMENTS

static inline ray_t next_ray(const scene_t *scene, layer_t layer, int4 tile, int first RAY_PARAMETERS) {
  ray_t ray = first_ray(&scene->film, &scene->source, tile, first RAY_ARGUMENTS);
  start(&ray, scene);
  return ray;
}

static inline int parks(const ray_t *ray, maskv travels, layer_t layer, int first) { return 0; }
