// mirror.cl: a ray that meets a mirrored face is reflected and stays on its side.
//
// provides  mirror_interface()        needs  prelude, ray, mirrored; generated: mirrored_at()
// source    the law of reflection; the share of the light that is reflected is 1
//
// The kernel has bent the ray by Snell's law before this. Which side a mirrored lane came from is known from `leaves`.

// Reflect the lanes that meet a mirrored face. *met is what effects read that concern every surface: mirrored lanes are
// totally reflected ones there. *glass has no mirrored lane: it is what effects read that concern refraction. Where it is
// not known whether a face is a mirror, the ray ends undecided, as it was before, to the rounding of its origin.
static inline void mirror_interface(ray_t *ray, const interface_t *at, const scene_t *scene, interface_t *met,
                                    interface_t *glass) {
  maskv unsure = (maskv)0;
  const maskv mirrors = mirrored_at(ray, at, scene, &unsure);
  *met = *glass = *at;
  if (!any_lane(mirrors | unsure)) return;
  ray->direction = pick3(mirrors, mirrored(at->incident, at->normal), ray->direction);
  ray->direction = pick3(unsure, at->incident, ray->direction);
  ray->origin = pick3(unsure, at3(ray->origin, at->incident, -at->length), ray->origin);
  ray->inside = (mirrors | unsure) ? (at->leaves ? at->lens : NOWHERE) : ray->inside;
  ray->events = unsure ? ray->events - (maskv)1 : ray->events;
  end_ray(ray, unsure, RAY_UNDECIDED);
  met->lanes = at->lanes & not_lane(unsure);
  met->total = (at->total | mirrors) & met->lanes;
  glass->lanes = met->lanes & not_lane(mirrors);
  glass->total = at->total & glass->lanes;
}
