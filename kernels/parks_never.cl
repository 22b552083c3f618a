// parks_never.cl: every packet is followed to its last ray's end.
//
// provides  next_ray(), parks(), PARK_PARAMETERS, PARK_ARGUMENTS; layer_t, layer_of_item()
// needs     ray, first_ray(), start()

#define PARK_PARAMETERS
#define PARK_ARGUMENTS

// One set of the scene's numbers serves all work-items, and every array has one layer.
typedef struct {
  int number, item, start;
} layer_t;

static inline layer_t layer_of_item(int4 tile PARK_PARAMETERS) {
  const layer_t layer = {0, (int)get_global_id(0), 0};
  return layer;
}

static inline ray_t next_ray(const scene_t *scene, int4 tile, int first RAY_PARAMETERS) {
  ray_t ray = first_ray(&scene->film, &scene->source, tile, first RAY_ARGUMENTS);
  start(&ray, scene);
  return ray;
}

static inline int parks(const ray_t *ray, maskv travels, int first) { return 0; }
