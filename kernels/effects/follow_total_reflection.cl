// follow_total_reflection.cl: a totally reflected ray stays on its side and goes on.
//
// provides  follow_total_reflection_interface()        needs  prelude, ray, mirrored
static inline void follow_total_reflection_interface(ray_t *ray, const interface_t *at, const scene_t *scene) {
  if (!any_lane(at->total)) return;
  ray->direction = pick3(at->total, mirrored(at->incident, at->normal), ray->direction);
}
