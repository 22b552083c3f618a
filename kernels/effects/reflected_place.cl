// reflected_place.cl: where on the picture's plane the reflection off the first surface lands.
//
// provides  reflected_place_start(), reflected_place_interface()        needs  prelude, ray, screen, fresnel_front, mirrored
// carries   reflected_s, reflected_t: (-1, -1) where there is none, or where it never meets the plane
static inline void reflected_place_start(ray_t *ray, const scene_t *scene) {
  ray->reflected_s = ray->reflected_t = (realv)-1;
}

static inline void reflected_place_interface(ray_t *ray, const interface_t *at, const scene_t *scene) {
  const maskv front = at_front(ray, at);
  if (!any_lane(front)) return;
  const place_t place = meet_plane(ray->origin, mirrored(at->incident, at->normal), &scene->picture);
  ray->reflected_s = front ? (place.meets ? place.s : (realv)-1) : ray->reflected_s;
  ray->reflected_t = front ? (place.meets ? place.t : (realv)-1) : ray->reflected_t;
}
