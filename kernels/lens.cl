// lens.cl: meet one lens. Into its space, ask its surface's search, and back with a point and a normal.
//
// provides  LENS(meet)(), LENS(start)()
// needs     prelude, ray, placement, search, SURFACE(root_ahead), SURFACE(gradient), SURFACE(leaf_gradient)
// set by    the generated assembly, once a lens: LENS_NUMBER; LENS(name), its own version of a name; SURFACE(name);
//           SURFACE(CONVEX), whether no ray that left the solid meets it again

// The outward normal in the world, from the gradient in local space, of a length that can be squared in either precision.
// Of the lanes, those without one, at a singular point, are left out of *defined.
static inline real3v LENS(normal)(const lens_t *lens, real3v gradient, maskv lanes, maskv *defined) {
  real3v n = to_world_normal(lens, gradient);
  realv square = dot3(n, n);
  *defined = (square > (realv)NUMBER(1e-24)) & (square < (realv)NUMBER(1e24));
  if (!any_lane(lanes & not_lane(*defined))) return n;

  // Scale by the largest part: 0, infinity and no number stay undefined
  const realv scale = down_scale(max_v(max_v(abs_v(n.x), abs_v(n.y)), abs_v(n.z)));
  const real3v m = {n.x * scale, n.y * scale, n.z * scale};
  n = pick3(*defined, n, m);
  square = dot3(n, n);
  *defined = (square > (realv)NUMBER(1e-24)) & (square < (realv)NUMBER(1e24));
  return n;
}

// Lanes whose normal looks the right way: against a ray that enters, along one that leaves, but for roundings. F falls
// where a ray enters; so a normal that looks the other way was taken where F is too steep for its digits, or jumps.
static inline maskv LENS(faces)(real3v normal, real3v direction, maskv inside) {
  const realv along = dot3(normal, direction);
  const realv astray = inside ? -along : along;
  const realv most = (realv)(64 * REAL_EPSILON);
  return (astray <= (realv)0) | (astray * astray <= most * most * dot3(normal, normal));
}

// Rays that start on this lens's surface start inside it if they enter. The host marks a ray as both inside the solid and on
// its surface if F is unknown where the ray starts: such a ray ends as undecided.
static inline void LENS(start)(ray_t *ray, const lens_t *lens, SURFACE(t) shape) {
  const maskv lanes = ray->alive & (ray->on == (maskv)LENS_NUMBER);
  if (!any_lane(lanes)) return;
  maskv defined;
  const real3v gradient = SURFACE(gradient)(to_local_point(lens, ray->origin), shape);
  const real3v normal = LENS(normal)(lens, gradient, lanes, &defined);
  const maskv enters = dot3(normal, ray->direction) < (realv)0;
  const maskv known = defined & (ray->inside != (maskv)LENS_NUMBER);
  ray->inside = (lanes & enters) ? (maskv)LENS_NUMBER : ray->inside;
  end_ray(ray, lanes & not_lane(known), RAY_UNDECIDED);
}

// Keep this lens's first root in *hit where it is nearer. Inside a solid only its own surface is asked.
static inline void LENS(meet)(const ray_t *ray, const lens_t *lens, SURFACE(t) shape, const method_t *method,
                              hit_t *hit) {
  const maskv inside = ray->inside == (maskv)LENS_NUMBER;
  const maskv departs = ray->on == (maskv)LENS_NUMBER;
  const maskv returns = SURFACE(CONVEX) ? not_lane(departs) : ray->alive;
  const maskv asks = ray->alive & (inside | ((ray->inside == NOWHERE) & returns));
  if (!any_lane(asks)) return;

  // Go into local space and ask there
  search_t search;
  search.origin = to_local_point(lens, ray->origin);
  search.direction = to_local_vector(lens, ray->direction);
  search.inside = inside;
  search.departs = departs;
  search.lanes = asks;
  realv from;
  const root_t root = SURFACE(root_ahead)(lens, &search, shape, method, &from);
  hit->searches += one_step(search.lanes);
  hit->steps += root.steps;
  hit->doubt = root.undecided ? min_v(hit->doubt, from + root.t) : hit->doubt;

  // Take the point and normal where this root is the nearest so far
  const realv t = from + root.t;
  const maskv nearer = root.found & (not_lane(hit->found) | (t < hit->t));
  if (!any_lane(nearer)) return;
  const real3v point = at3(search.origin, search.direction, root.t);
  maskv defined;
  const real3v gradient = SURFACE(leaf_gradient)(point, shape, root.leaf);
  const real3v normal = LENS(normal)(lens, gradient, nearer, &defined);
  hit->t = nearer ? t : hit->t;
  hit->point = pick3(nearer, to_world_point(lens, point), hit->point);
  hit->normal = pick3(nearer, normal, hit->normal);
  hit->n_lens = nearer ? (realv)lens->n : hit->n_lens;
  hit->eta = nearer ? (inside ? (realv)lens->eta_out : (realv)lens->eta_in) : hit->eta;
  hit->lens = nearer ? (maskv)LENS_NUMBER : hit->lens;
  hit->found = hit->found | nearer;
  const maskv doubtful = nearer & not_lane(defined & LENS(faces)(normal, ray->direction, inside));
  hit->doubt = doubtful ? min_v(hit->doubt, t) : hit->doubt;
}
