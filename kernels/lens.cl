// lens.cl: meet one lens. Into its space, ask its surface's search, and back with a point and a normal.
//
// provides  LENS(meet)(), LENS(start)()
// needs     prelude, ray, placement, search, SURFACE(first_root), SURFACE(gradient)
// set by    the generated assembly, once a lens: LENS_NUMBER; LENS(name), its own version of a name; SURFACE(name)

// The outward unit normal at a local point, in the world. Lanes without one, at a singular point, are left out of *defined.
static inline real3v LENS(normal)(const lens_t *lens, SURFACE(t) shape, real3v p, maskv *defined) {
  const real3v n = to_world_normal(lens, SURFACE(gradient)(p, shape));

  // Scale by the largest part first: a squared gradient may leave the range of numbers
  const realv scale = (realv)1 / max_v(max_v(abs_v(n.x), abs_v(n.y)), abs_v(n.z));
  const real3v m = {n.x * scale, n.y * scale, n.z * scale};
  const realv square = dot3(m, m);
  *defined = (square >= (realv)NUMBER(0.5)) & (square <= (realv)4);  // 1 to 3 but for rounding; false for no number
  return unit3(m);
}

// Rays that start on this lens's surface start inside it if they enter.
static inline void LENS(start)(ray_t *ray, const lens_t *lens, SURFACE(t) shape) {
  const maskv lanes = ray->alive & (ray->on == (maskv)LENS_NUMBER);
  if (!any_lane(lanes)) return;
  maskv defined;
  const real3v normal = LENS(normal)(lens, shape, to_local_point(lens, ray->origin), &defined);
  const maskv enters = dot3(normal, ray->direction) < (realv)0;
  ray->inside = (lanes & enters) ? (maskv)LENS_NUMBER : ray->inside;
  end_ray(ray, lanes & not_lane(defined), RAY_UNDECIDED);
}

// Keep this lens's first root in *hit where it is nearer. Inside a solid only its own surface is asked.
static inline void LENS(meet)(const ray_t *ray, const lens_t *lens, SURFACE(t) shape, const method_t *method,
                              hit_t *hit) {
  const maskv inside = ray->inside == (maskv)LENS_NUMBER;
  const maskv asks = ray->alive & (inside | (ray->inside == NOWHERE));
  if (!any_lane(asks)) return;

  // Go into local space, where the ray's origin is moved to its entry into the bounding box: the digits of a far
  // origin would be lost in F. A known root must stay at t = 0
  const real3v origin = to_local_point(lens, ray->origin);
  const real3v direction = to_local_vector(lens, ray->direction);
  const maskv departs = ray->on == (maskv)LENS_NUMBER;
  const span_t span = span_in_box(lens, origin, direction);
  const realv enter = (departs | inside) ? (realv)0 : span.enter;
  const maskv crosses = enter < span.leave;
  hit->doubt = (asks & inside & not_lane(crosses)) ? (realv)0 : hit->doubt;
  if (!any_lane(asks & crosses)) return;

  search_t search;
  search.origin = at3(origin, direction, enter);
  search.direction = direction;
  search.length = span.leave - enter;
  search.inside = inside;
  search.departs = departs;
  search.lanes = asks & crosses;
  const root_t root = SURFACE(first_root)(search, shape, method);
  hit->doubt = root.undecided ? min_v(hit->doubt, enter + root.t) : hit->doubt;

  // Take the point and normal where this root is the nearest so far
  const realv t = enter + root.t;
  const maskv nearer = root.found & (not_lane(hit->found) | (t < hit->t));
  if (!any_lane(nearer)) return;
  const real3v point = at3(search.origin, direction, root.t);
  maskv defined;
  const real3v normal = LENS(normal)(lens, shape, point, &defined);
  hit->t = nearer ? t : hit->t;
  hit->point = pick3(nearer, to_world_point(lens, point), hit->point);
  hit->normal = pick3(nearer, normal, hit->normal);
  hit->n_lens = nearer ? (realv)lens->n : hit->n_lens;
  hit->lens = nearer ? (maskv)LENS_NUMBER : hit->lens;
  hit->found = hit->found | nearer;
  hit->doubt = (nearer & not_lane(defined)) ? min_v(hit->doubt, t) : hit->doubt;
}
