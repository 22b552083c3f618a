// follow_total_reflection.cl: a totally reflected ray stays on its side and goes on.
//
// provides  follow_total_reflection_interface()        needs  prelude, ray
// source    the law of reflection: the part along the normal is turned round
static inline void follow_total_reflection_interface(ray_t *ray, const interface_t *at, const scene_t *scene) {
  if (!any_lane(at->total)) return;
  const realv twice = (realv)-2 * dot3(at->incident, at->normal) / dot3(at->normal, at->normal);
  ray->direction = pick3(at->total, at3(at->incident, at->normal, twice), ray->direction);
}
