// screen_nested.cl: land() for rays that may have left a solid on the picture's plane.
//
// provides  land_from_glass()        needs  prelude, ray_nested, screen
//
// A solid may lie on the plane of the picture and reach beyond the picture. A ray that leaves it there meets the plane
// where it is, and not ahead or behind by what rounding makes of a distance of 0.

// As land(); rays whose last surface lies on the plane, to rounding, have met the plane there. Beside the picture they end
// off it; where it is not known whether that is beside it, they end undecided.
static inline place_t land_from_glass(ray_t *ray, const picture_t *picture) {
  const place_t here = meet_plane(ray->origin, ray->direction, picture);
  const real3v normal = broadcast3(picture->normal);
  const real3v dual_s = broadcast3(picture->dual_s), dual_t = broadcast3(picture->dual_t);
  const realv reach = longest(ray->origin) + longest(broadcast3(picture->corner));
  const realv off = (realv)(8 * REAL_EPSILON) * reach;
  const realv blur = off / abs_v(dot3(normal, ray->direction));
  const realv aside = off + blur;
  const maskv on_plane = ray->alive & (ray->events > (maskv)0) & (abs_v(here.distance) <= blur) &
                         (abs_v(here.s) <= FARTHEST) & (abs_v(here.t) <= FARTHEST);
  const realv s = abs_v(here.s - (realv)NUMBER(0.5)), t = abs_v(here.t - (realv)NUMBER(0.5));
  const maskv beside = (s > (realv)NUMBER(0.5) + aside * sqrt(dot3(dual_s, dual_s))) |
                       (t > (realv)NUMBER(0.5) + aside * sqrt(dot3(dual_t, dual_t)));
  const maskv lands = on_plane & beside;
  end_ray(ray, lands, RAY_OFF_PICTURE);
  end_ray(ray, on_plane & not_lane(beside), RAY_UNDECIDED);

  place_t place = land(ray, picture);
  place.s = lands ? here.s : place.s;
  place.t = lands ? here.t : place.t;
  place.distance = lands ? (realv)0 : place.distance;
  place.meets = place.meets | lands;
  return place;
}
