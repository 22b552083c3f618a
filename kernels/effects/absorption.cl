// absorption.cl: what a ray loses inside lenses.
//
// provides  absorption_start(), absorption_interface()        needs  prelude, ray; generated: lens_absorption()
// carries   red, green, blue: what is left
// source    the law of Beer and Lambert: exp(-a L) after a length L, a per scene unit
static inline void absorption_start(ray_t *ray, const scene_t *scene) {
  ray->red = ray->green = ray->blue = (realv)1;
}

static inline void absorption_interface(ray_t *ray, const interface_t *at, const scene_t *scene) {
  const realv length = (at->lanes & at->leaves) ? at->length : (realv)0;  // 0 around lenses: exp(0) takes nothing
  ray->red *= exp(-length * lens_absorption(scene, at->lens, 0));
  ray->green *= exp(-length * lens_absorption(scene, at->lens, 1));
  ray->blue *= exp(-length * lens_absorption(scene, at->lens, 2));
}
