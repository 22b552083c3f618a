// lens_coat.cl: whether a surface point of one lens lies on a mirrored face, as far as rounding lets that be told.
//
// provides  LENS(is_coated)()        needs  prelude, placement, coats; LENS(coat)(), generated
// set by    the generated assembly: as for lens.cl
//
// A point is off the surface by what the search has left, by rounding of the ray and by that of the faces' functions. All
// of it moves the point along the ray to first order, by the function that is nearest to 0 over its slope. On that way the
// two functions come nearer to each other by no more than the difference of their slopes allows.

// Lanes of `asks` whose point lies on a mirrored face. Where it is not known on which side of an edge it lies, the lane is
// put into *unsure.
//
//   point, direction  world: on the surface, and along the ray that came to it     length  of the ray to there
static inline maskv LENS(is_coated)(const lens_t *lens, SURFACE(t) shape, real3v point, real3v direction, realv length,
                                    maskv asks, maskv *unsure) {
  if (!any_lane(asks)) return (maskv)0;
  const real3v way = to_local_vector(lens, direction);
  const coat_t at = LENS(coat)(to_local_point(lens, point), shape);
  const maskv is_coated = at.coat > at.rest;
  const real3v gradient = pick3(is_coated, at.coat_gradient, at.rest_gradient);
  const real3v between = at3(at.coat_gradient, at.rest_gradient, (realv)-1);
  const realv noise = (realv)lens->coat_noise, reach = coat_reach(lens, point, length);
  const realv level = abs_v(is_coated ? at.coat : at.rest) + noise + reach * coat_spread(lens, gradient);
  const realv moved = level / abs_v(dot3(gradient, way));
  const realv error = (realv)2 * noise + reach * coat_spread(lens, between) + moved * abs_v(dot3(between, way));
  *unsure = *unsure | (asks & not_lane(abs_v(at.coat - at.rest) > error));
  return asks & is_coated;
}
