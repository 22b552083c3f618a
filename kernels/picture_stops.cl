// picture_stops.cl: a picture that is a screen: rays end on it wherever they meet it first, in a solid too.
//
// provides  picture_met()        needs  prelude, ray_nested, screen; picture_t

#define LIES_ALONG ((realv)NUMBER(1e-12))  // square of the sine between the normals of a picture and a face that it lies on

// Returns the lanes that end on the picture: they meet it before the surfaces in *hit, or on one that is parallel to it.
// *hit holds no surface there. The order is in doubt, and the ray undecided, in three cases: a surface is met within
// rounding of the picture and is not parallel to it (in single precision: whether parallel or not); an edge of the picture
// is met before a surface; the ray starts on the picture.
static inline maskv picture_met(const ray_t *ray, maskv travels, hit_t *hit, const picture_t *picture) {
  const place_t place = meet_plane(ray->origin, ray->direction, picture);
  const real3v normal = broadcast3(picture->normal);
  const real3v dual_s = broadcast3(picture->dual_s), dual_t = broadcast3(picture->dual_t);

  // Rounding of the point and of the distance, and what they do to the coordinates
  const realv reach = longest(ray->origin) + longest(broadcast3(picture->corner)) + abs_v(place.distance);
  const realv off = (realv)(8 * REAL_EPSILON) * reach;
  const realv blur = off / abs_v(dot3(normal, ray->direction));
  const realv aside = off + blur;
  const realv s_blur = aside * sqrt(dot3(dual_s, dual_s)), t_blur = aside * sqrt(dot3(dual_t, dual_t));
  const realv s = abs_v(place.s - (realv)NUMBER(0.5)), t = abs_v(place.t - (realv)NUMBER(0.5));
  const realv edge = (realv)NUMBER(0.5);
  const maskv may_be_on = (s <= edge + s_blur) & (t <= edge + t_blur) & (place.distance > -blur);
  const maskv is_ahead = place.distance > blur;
  const maskv is_on = (s < edge - s_blur) & (t < edge - t_blur) & is_ahead;

  // Which comes first
  const maskv behind = hit->found & (place.distance - blur > hit->high);
  const maskv before = not_lane(hit->found) | (place.distance + blur < hit->low);
  const real3v across = cross3(normal, hit->normal);
  const maskv along = dot3(across, across) <= LIES_ALONG * dot3(hit->normal, hit->normal);
  const maskv touched = along & not_lane((maskv)(MASK)!CONTACT_IS_DECIDED);
  const maskv stopped = travels & is_on & not_lane(behind) & (before | touched);
  const maskv unknown = travels & may_be_on & not_lane(behind | stopped) & (hit->found | not_lane(is_ahead));
  hit->doubt = unknown ? min_v(hit->doubt, max_v(place.distance - blur, (realv)0)) : hit->doubt;
  hit->high = stopped ? place.distance + blur : hit->high;
  hit->found = hit->found & not_lane(stopped);
  return stopped;
}
#undef LIES_ALONG
