// fresnel.cl: the share of unpolarised light that is refracted, surface after surface.
//
// provides  fresnel_start(), fresnel_interface()        needs  prelude, ray
// carries   transmittance
// source    Born & Wolf, Principles of Optics, 7th ed., sec. 1.5.3: with c and k the cosines before and behind the surface,
//           T is 4 n_before c n_after k over the square of n_before c + n_after k (s), or of n_after c + n_before k (p).
//           As a product nothing cancels, and the normal's length is no matter
//
// Light is taken as unpolarised again before every surface. Power, not radiance: no n^2. Total reflection loses nothing.
static inline void fresnel_start(ray_t *ray, const scene_t *scene) { ray->transmittance = (realv)1; }

static inline void fresnel_interface(ray_t *ray, const interface_t *at, const scene_t *scene) {
  const maskv refracted = at->lanes & not_lane(at->total) & ray->alive;
  const realv before = max_v(-dot3(at->incident, at->normal), (realv)0);
  const realv behind = max_v(-dot3(ray->direction, at->normal), (realv)0);
  const realv s = at->n_before * before + at->n_after * behind;
  const realv p = at->n_after * before + at->n_before * behind;
  const realv both = (realv)2 * at->n_before * before * at->n_after * behind;
  const realv share = both > (realv)0 ? both / (s * s) + both / (p * p) : (realv)0;
  ray->transmittance *= refracted ? share : (realv)1;
}
