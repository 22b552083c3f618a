// end_at_total_reflection.cl: a totally reflected ray ends where that happens.
//
// provides  end_at_total_reflection()        needs  prelude, ray
static inline void end_at_total_reflection(ray_t *ray, const interface_t *at) {
  end_ray(ray, at->total, RAY_TOTAL_REFLECTION);
}
