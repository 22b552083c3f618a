// footprint_parallel.cl: how a ray's start changes with its film pixel, for parallel light.
//
// provides  footprint_ways()        needs  prelude, ray
//
// The direction stays, and the start follows the film's point. Where along the ray it does so is no matter.

static inline void footprint_ways(const ray_t *ray, const scene_t *scene, real3v step, real3v *point, real3v *turn) {
  const real3v nowhere = {(realv)0, (realv)0, (realv)0};
  *point = step;
  *turn = nowhere;
}
