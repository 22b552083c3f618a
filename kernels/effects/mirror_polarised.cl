// mirror_polarised.cl: what a mirror makes of polarised light: its mirror image, as an ideal conductor does.
//
// provides  mirror_polarised()        needs  prelude, ray, mirrored, fresnel_polarised
//
// s and p keep their power, and the field behind the mirror is the mirror image of that before it, but for a sign of both.
// So the axis across the ray is reflected as the ray is. The third axis, d x that, then points to the other side: U and V
// change their signs. The phase that a metal adds to s and p is left out.
static inline void mirror_polarised(ray_t *ray, const interface_t *met, const interface_t *glass) {
  const maskv lanes = met->total & not_lane(glass->total) & ray->alive;
  if (!any_lane(lanes)) return;
  const real3v old = {ray->across_x, ray->across_y, ray->across_z};
  const real3v turned = mirrored(old, met->normal);
  ray->across_x = lanes ? turned.x : ray->across_x;
  ray->across_y = lanes ? turned.y : ray->across_y;
  ray->across_z = lanes ? turned.z : ray->across_z;
  ray->polarised_u = lanes ? -ray->polarised_u : ray->polarised_u;
  ray->polarised_v = lanes ? -ray->polarised_v : ray->polarised_v;
}
