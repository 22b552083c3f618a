// opaque.cl: a ray that meets an opaque lens ends there.
//
// provides  opaque_interface()        needs  prelude, ray; generated: lens_absorbs()
static inline void opaque_interface(ray_t *ray, const interface_t *at, const scene_t *scene) {
  end_ray(ray, at->lanes & (lens_absorbs(scene, at->lens, 0) != (realv)0), RAY_BLOCKED);
}
