// opaque.cl: a ray that meets an opaque lens ends there.
//
// provides  opaque_interface(), opaque_after()        needs  prelude, ray; generated: lens_absorbs()
static inline void opaque_interface(ray_t *ray, const interface_t *at, const scene_t *scene) {
  end_ray(ray, at->lanes & (lens_absorbs(scene, at->lens, 0) != (realv)0), RAY_BLOCKED);
}

// A blocked ray keeps the direction in which it came. The direction by Snell's law is replaced, as it may be wrong: an
// opaque surface never reflects totally, so the kernel may leave out total reflection though the lens has the lower index.
static inline void opaque_after(ray_t *ray, const interface_t *at, const scene_t *scene) {
  ray->direction = pick3(at->lanes & (ray->status == (maskv)RAY_BLOCKED), at->incident, ray->direction);
}
