// fresnel_front.cl: the share of unpolarised light that the first surface reflects, met from outside.
//
// provides  fresnel_front_start(), fresnel_front_interface(), at_front()        needs  prelude, ray, fresnel
// carries   reflectance: 0 where no surface is met, where the source lies inside, and where all is reflected, as then the
//           ray itself goes that way
//
// What is reflected goes straight to the environment: it meets no lens.

// Lanes that meet their first surface, from outside, and are refracted there.
static inline maskv at_front(const ray_t *ray, const interface_t *at) {
  const maskv first = at->lanes & (ray->events == (maskv)1) & not_lane(at->leaves);
  return first & not_lane(at->total) & ray->alive;
}

static inline void fresnel_front_start(ray_t *ray, const scene_t *scene) { ray->reflectance = (realv)0; }

static inline void fresnel_front_interface(ray_t *ray, const interface_t *at, const scene_t *scene) {
  const realv share = max_v((realv)1 - ray->transmittance, (realv)0);  // of 1 rounding may leave more
  ray->reflectance = at_front(ray, at) ? share : ray->reflectance;
}
