// lens_hessian.cl: how the normal of one lens's surface turns on small ways along it.
//
// provides  LENS(hessian)(), once a lens        needs  prelude, placement, hessian, SURFACE(hessian)
// set by    the generated assembly: as for lens.cl
//
// The world's F is the local one behind the map to local space: a way goes there as a vector, and what it changes of
// the gradient comes back as a gradient does.

static inline real3v LENS(turned)(const lens_t *lens, const realv h[6], real3v way) {
  const real3v v = to_local_vector(lens, way);
  const real3v change = {h[0] * v.x + h[1] * v.y + h[2] * v.z,   //
                         h[1] * v.x + h[3] * v.y + h[4] * v.z,   //
                         h[2] * v.x + h[4] * v.y + h[5] * v.z};
  return to_world_normal(lens, change);
}

static inline void LENS(hessian)(const lens_t *lens, SURFACE(t) shape, maskv lanes, hessian_t *asked) {
  real3v gradient;
  realv h[6];
  SURFACE(hessian)(to_local_point(lens, asked->point), shape, &gradient, h);
  asked->gradient = pick3(lanes, to_world_normal(lens, gradient), asked->gradient);
  asked->change[0] = pick3(lanes, LENS(turned)(lens, h, asked->way[0]), asked->change[0]);
  asked->change[1] = pick3(lanes, LENS(turned)(lens, h, asked->way[1]), asked->change[1]);
}
