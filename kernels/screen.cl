// screen.cl: where a ray's last straight leg meets the picture's plane.
//
// provides  meet_plane(), land()        needs  prelude, ray; picture_t { corner, normal, dual_s, dual_t }
//
// The duals are made once by the host: dual_s . right = 1, dual_s . down = 0, and the other way round for dual_t. The
// solve is then three dot products, and the shape of the parallelogram costs no digits here.

// The coordinate is a place only up to this size; beyond, the ray is as good as parallel to the plane.
#define FARTHEST ((realv)NUMBER(1e30))

typedef struct {
  realv s, t;      // picture coordinates; (-1, -1) where the plane is not met
  realv distance;  // of the plane from the ray's origin, scene units
  maskv meets;     // lanes that meet the plane ahead
} place_t;

// Meet the plane ahead; where `meets` is not set the coordinates are none.
static inline place_t meet_plane(real3v origin, real3v direction, const picture_t *picture) {
  const real3v normal = broadcast3(picture->normal);
  const real3v from_corner = at3(origin, broadcast3(picture->corner), (realv)-1);
  const realv distance = -dot3(normal, from_corner) / dot3(normal, direction);

  // Read the coordinates by the duals
  const real3v dual_s = broadcast3(picture->dual_s), dual_t = broadcast3(picture->dual_t);
  const realv s = dot3(dual_s, from_corner) + distance * dot3(dual_s, direction);
  const realv t = dot3(dual_t, from_corner) + distance * dot3(dual_t, direction);
  const maskv meets = (distance > (realv)0) & (abs_v(s) <= FARTHEST) & (abs_v(t) <= FARTHEST);
  const place_t place = {s, t, distance, meets};
  return place;
}

// End all living rays on the picture, beside it, or nowhere.
static inline place_t land(ray_t *ray, const picture_t *picture) {
  place_t place = meet_plane(ray->origin, ray->direction, picture);
  const realv s = place.s, t = place.t;

  // The picture is half open: 0 is on it, 1 is not
  const maskv within = place.meets & (s >= (realv)0) & (s < (realv)1) & (t >= (realv)0) & (t < (realv)1);
  const maskv lands = ray->alive, arrives = lands & place.meets;
  end_ray(ray, lands & within, RAY_PICTURE);
  end_ray(ray, arrives & not_lane(within), RAY_OFF_PICTURE);
  end_ray(ray, lands & not_lane(place.meets), RAY_BEHIND);
  place.s = arrives ? s : (realv)-1;
  place.t = arrives ? t : (realv)-1;
  place.meets = arrives;
  return place;
}
