// reflected_away.cl: where the reflection off the first surface goes.
//
// provides  reflected_away_start(), reflected_away_interface()        needs  prelude, ray, fresnel_front, mirrored
// carries   reflected_x, reflected_y, reflected_z: its unit direction, 0 where there is none
static inline void reflected_away_start(ray_t *ray, const scene_t *scene) {
  ray->reflected_x = ray->reflected_y = ray->reflected_z = (realv)0;
}

static inline void reflected_away_interface(ray_t *ray, const interface_t *at, const scene_t *scene) {
  const maskv front = at_front(ray, at);
  if (!any_lane(front)) return;
  const real3v away = mirrored(at->incident, at->normal);
  ray->reflected_x = front ? away.x : ray->reflected_x;
  ray->reflected_y = front ? away.y : ray->reflected_y;
  ray->reflected_z = front ? away.z : ray->reflected_z;
}
