// absorption_nested.cl: absorption.cl where solids may touch or overlap: the medium of each stretch takes its part.
//
// provides  absorption_start(), absorption_interface(), absorption_picture()
// needs     prelude, ray_nested, screen; generated: lens_absorption(), medium_of()
// carries   red, green, blue: what is left
// source    the law of Beer and Lambert: exp(-a L) after a length L, a per scene unit
static inline void absorption_start(ray_t *ray, const scene_t *scene) {
  ray->red = ray->green = ray->blue = (realv)1;
}

static inline void absorption_interface(ray_t *ray, const interface_t *at, const scene_t *scene) {
  const realv length = (at->lanes & at->leaves) ? at->length : (realv)0;  // 0 around lenses: exp(0) takes nothing
  ray->red *= exp(-length * lens_absorption(scene, at->before, 0));
  ray->green *= exp(-length * lens_absorption(scene, at->before, 1));
  ray->blue *= exp(-length * lens_absorption(scene, at->before, 2));
}

// The last leg may end on a picture in a solid.
static inline void absorption_picture(ray_t *ray, const place_t *place, const scene_t *scene) {
  const maskv medium = medium_of(ray->inside);
  const realv length = ((medium != NOWHERE) & place->meets) ? place->distance : (realv)0;
  ray->red *= exp(-length * lens_absorption(scene, medium, 0));
  ray->green *= exp(-length * lens_absorption(scene, medium, 1));
  ray->blue *= exp(-length * lens_absorption(scene, medium, 2));
}
