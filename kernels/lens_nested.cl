// lens_nested.cl: meet one lens of several that may touch or overlap.
//
// provides  LENS(meet_nested)(), LENS(start_nested)()
// needs     prelude, ray_nested, placement, search, lens
// set by    the generated assembly, once a lens: as for lens.cl; LENS_BIT, the lens's place in a set

#define PARALLEL ((realv)NUMBER(1e-12))  // square of the sine between normals that are those of one interface

// Rays that start on this lens's surface start inside it if they enter. The host puts a lens into both sets if F is unknown
// where the ray starts: such a ray ends as undecided.
static inline void LENS(start_nested)(ray_t *ray, const lens_t *lens, SURFACE(t) shape) {
  const maskv lanes = ray->alive & ((ray->on & LENS_BIT) != (maskv)0);
  if (!any_lane(lanes)) return;
  maskv defined;
  const real3v gradient = SURFACE(gradient)(to_local_point(lens, ray->origin), shape);
  const real3v normal = LENS(normal)(lens, gradient, lanes, &defined);
  const maskv enters = dot3(normal, ray->direction) < (realv)0;
  const maskv known = defined & ((ray->inside & LENS_BIT) == (maskv)0);
  ray->inside = (lanes & enters) ? ray->inside | LENS_BIT : ray->inside;
  end_ray(ray, lanes & not_lane(known), RAY_UNDECIDED);
}

// Join this lens's first root to *hit: it replaces what lies farther away beyond rounding, and is one interface with what
// lies no farther from it than rounding.
static inline void LENS(meet_nested)(const ray_t *ray, const lens_t *lens, SURFACE(t) shape, const method_t *method,
                                     hit_t *hit) {
  const maskv inside = (ray->inside & LENS_BIT) != (maskv)0;
  const maskv departs = (ray->on & LENS_BIT) != (maskv)0;
  const maskv returns = SURFACE(CONVEX) ? not_lane(departs) : ray->alive;
  const maskv asks = ray->alive & (inside | returns);
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
  hit->doubt = (asks & inside & not_lane(root.found | root.undecided)) ? (realv)0 : hit->doubt;
  if (!any_lane(root.found)) return;

  // What rounding of F and of the point does to the root, to first order
  const realv t = from + root.t;
  const real3v point = at3(search.origin, search.direction, root.t);
  const real3v gradient = SURFACE(leaf_gradient)(point, shape, root.leaf);
  const realv slope = abs_v(dot3(gradient, search.direction));
  const realv size = abs_v(gradient.x) + abs_v(gradient.y) + abs_v(gradient.z);
  const realv blur = ((realv)lens->noise + (realv)lens->place * size) / slope;  // infinity where the ray grazes
  const realv low = t - blur, high = t + blur;

  const maskv first = root.found & (not_lane(hit->found) | (high < hit->low));
  const maskv joins = root.found & not_lane(first) & not_lane(low > hit->high);
  const maskv taken = first | (joins & (t < hit->t));
  const maskv asked = first | joins;
  if (!any_lane(asked)) return;
  maskv defined;
  const real3v outward = LENS(normal)(lens, gradient, asked, &defined);
  const maskv faces = LENS(faces)(outward, ray->direction, inside);

  // Surfaces that are not parallel meet in an edge: which one comes first is not known there
  const real3v across = cross3(outward, hit->normal);
  const realv sine = dot3(across, across);
  const maskv parallel = sine <= PARALLEL * dot3(outward, outward) * dot3(hit->normal, hit->normal);
  const maskv unknown = joins & not_lane(parallel & (maskv)(MASK)CONTACT_IS_DECIDED);
  const maskv doubtful = (asked & not_lane(defined & faces)) | unknown;
  hit->doubt = doubtful ? min_v(hit->doubt, joins ? min_v(t, hit->t) : t) : hit->doubt;

  const realv turns = inside ? (realv)-1 : (realv)1;
  const real3v against = {turns * outward.x, turns * outward.y, turns * outward.z};
  hit->point = pick3(taken, to_world_point(lens, point), hit->point);
  hit->normal = pick3(taken, against, hit->normal);
  hit->lens = taken ? (maskv)LENS_NUMBER : hit->lens;
  hit->t = taken ? t : hit->t;
  hit->low = first ? low : joins ? min_v(low, hit->low) : hit->low;
  hit->high = first ? high : joins ? max_v(high, hit->high) : hit->high;
  hit->crossed = first ? LENS_BIT : joins ? hit->crossed | LENS_BIT : hit->crossed;
  hit->found = hit->found | first;
}
#undef PARALLEL
