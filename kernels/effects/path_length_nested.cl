// path_length_nested.cl: path_length.cl where solids may touch or overlap: the picture may lie in one.
//
// provides  path_length_start(), path_length_interface(), path_length_picture()
// needs     prelude, ray_nested, screen; generated: medium_of(), index_of()
// carries   path_length, scene units
static inline void path_length_start(ray_t *ray, const scene_t *scene) { ray->path_length = (realv)0; }

static inline void path_length_interface(ray_t *ray, const interface_t *at, const scene_t *scene) {
  ray->path_length += at->lanes ? at->n_before * at->length : (realv)0;
}

// The last leg ends on the picture's plane, on it or beside it; a ray that never meets the plane has no length to it.
static inline void path_length_picture(ray_t *ray, const place_t *place, const scene_t *scene) {
  const realv whole = ray->path_length + index_of(scene, medium_of(ray->inside)) * place->distance;
  ray->path_length = place->meets ? whole : (realv)-1;
}
