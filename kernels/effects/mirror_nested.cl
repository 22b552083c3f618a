// mirror_nested.cl: mirror.cl where solids may touch or overlap: of the surfaces met, those count whose solid is a medium.
//
// provides  mirror_interface()        needs  prelude, ray_nested, mirrored; generated: mirrored_at()
// source    the law of reflection; the share of the light that is reflected is 1

// As in mirror.cl. The kernel has taken the ray through the surfaces of `ray->on`, unless it was totally reflected.
static inline void mirror_interface(ray_t *ray, const interface_t *at, const scene_t *scene, interface_t *met,
                                    interface_t *glass) {
  maskv unsure = (maskv)0;
  const maskv mirrors = mirrored_at(ray, at, scene, &unsure);
  *met = *glass = *at;
  if (!any_lane(mirrors | unsure)) return;
  ray->direction = pick3(mirrors, mirrored(at->incident, at->normal), ray->direction);
  ray->direction = pick3(unsure, at->incident, ray->direction);
  ray->origin = pick3(unsure, at3(ray->origin, at->incident, -at->length), ray->origin);
  const maskv crossed = (mirrors | unsure) & not_lane(at->total);
  ray->inside = crossed ? ray->inside ^ ray->on : ray->inside;
  ray->events = unsure ? ray->events - (maskv)1 : ray->events;
  end_ray(ray, unsure, RAY_UNDECIDED);
  met->lanes = at->lanes & not_lane(unsure);
  met->total = (at->total | mirrors) & met->lanes;
  glass->lanes = met->lanes & not_lane(mirrors);
  glass->total = at->total & glass->lanes;
}
