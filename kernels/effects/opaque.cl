// opaque.cl: a ray that meets an opaque lens ends there.
//
// provides  opaque_interface(), opaque_after()        needs  prelude, ray; generated: lens_absorbs()
static inline void opaque_interface(ray_t *ray, const interface_t *at, const scene_t *scene) {
  end_ray(ray, at->lanes & (lens_absorbs(scene, at->lens, 0) != (realv)0), RAY_BLOCKED);
}

// Nothing bends it there: its direction stays the one in which it came. What Snell's law gives is none where the lens has
// an index below the one around it: an opaque surface never reflects totally, so the law is compiled as if it could not.
static inline void opaque_after(ray_t *ray, const interface_t *at, const scene_t *scene) {
  ray->direction = pick3(at->lanes & (ray->status == (maskv)RAY_BLOCKED), at->incident, ray->direction);
}
