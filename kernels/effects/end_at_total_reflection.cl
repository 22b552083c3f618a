// end_at_total_reflection.cl: a totally reflected ray ends where that happens.
//
// provides  end_at_total_reflection_interface()        needs  prelude, ray
static inline void end_at_total_reflection_interface(ray_t *ray, const interface_t *at, const scene_t *scene) {
  end_ray(ray, at->total & ray->alive, RAY_TOTAL_REFLECTION);
}
