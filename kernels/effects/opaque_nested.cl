// opaque_nested.cl: opaque.cl where solids may touch or overlap: a ray ends where an opaque lens becomes its medium, or
// ceases to be.
//
// provides  opaque_interface(), opaque_after()        needs  prelude, ray_nested; generated: lens_absorbs()
static inline void opaque_interface(ray_t *ray, const interface_t *at, const scene_t *scene) {
  const maskv enters = (at->after != NOWHERE) & (lens_absorbs(scene, at->after, 0) != (realv)0);
  const maskv leaves = (at->before != NOWHERE) & (lens_absorbs(scene, at->before, 0) != (realv)0);
  end_ray(ray, at->lanes & (enters | leaves), RAY_BLOCKED);
}

// A blocked ray keeps the direction in which it came.
static inline void opaque_after(ray_t *ray, const interface_t *at, const scene_t *scene) {
  ray->direction = pick3(at->lanes & (ray->status == (maskv)RAY_BLOCKED), at->incident, ray->direction);
}
