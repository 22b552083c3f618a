// lens_nested.cl: meet one lens of several that may touch or overlap.
//
// provides  LENS(meet_nested)(), LENS(start_nested)()
// needs     prelude, ray_nested, placement, search, lens; SURFACE(leaf_f_gradient)
// set by    the generated assembly, once a lens: as for lens.cl; LENS_BIT, the lens's place in a set; HAS_LENS(), NOTE_CROSSED() of sets_*.cl

#define PARALLEL ((realv)NUMBER(1e-12))  // square of the sine between normals that are those of one interface
// Of the size of a lens and of its distance from the world's origin: faces are one interface that are less than CONTACT
// apart along their normal, for certain, and two that are more than APART so. The numbers of a scene are rounded by less
// than APART; what is between may be either
#define CONTACT ((realv)NUMBER(5.7e-14))
#define APART ((realv)NUMBER(3.6e-15))
#define PLACED ((realv)(16 * REAL_EPSILON))  // of the coordinates on the way to local space and along the ray
#define GRAZES sqrt((real)REAL_EPSILON)      // sine of the angle to the surface below which F's slope says too little

// Rays that start on this lens's surface start inside it if they enter. The host puts a lens into both sets if F is unknown
// where the ray starts: such a ray ends as undecided.
static inline void LENS(start_nested)(ray_t *ray, const lens_t *lens, SURFACE(t) shape) {
  const maskv lanes = ray->alive & HAS_LENS(ray, ray->on);
  if (!any_lane(lanes)) return;
  maskv defined;
  const real3v gradient = SURFACE(gradient)(to_local_point(lens, ray->origin), shape);
  const real3v normal = LENS(normal)(lens, gradient, lanes, &defined);
  const maskv enters = dot3(normal, ray->direction) < (realv)0;
  const maskv known = defined & not_lane(HAS_LENS(ray, ray->inside));
  ray->inside = (lanes & enters) ? ray->inside | LENS_BIT : ray->inside;
  end_ray(ray, lanes & not_lane(known), RAY_UNDECIDED);
}

// What F changes by where each coordinate of a point in the world does, at most, by so much.
static inline realv LENS(spread)(const lens_t *lens, real3v gradient) {
  const real *m = lens->to_local;
  return (realv)(fabs(m[0]) + fabs(m[1]) + fabs(m[2])) * abs_v(gradient.x) +
         (realv)(fabs(m[3]) + fabs(m[4]) + fabs(m[5])) * abs_v(gradient.y) +
         (realv)(fabs(m[6]) + fabs(m[7]) + fabs(m[8])) * abs_v(gradient.z);
}

// Join this lens's first root to *hit: it replaces what lies farther away beyond rounding, and is one interface with what
// lies no farther from it than rounding.
static inline void LENS(meet_nested)(const ray_t *ray, const lens_t *lens, SURFACE(t) shape, const method_t *method,
                                     hit_t *hit) {
  const maskv inside = HAS_LENS(ray, ray->inside);
  const maskv departs = HAS_LENS(ray, ray->on);
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

  // What rounding of F and of the ray does to the root, to first order. Where the ray grazes that says nothing, and it is
  // the search that tells between which places the root is
  const realv t = from + root.t;
  const real3v point = at3(search.origin, search.direction, root.t);
  const real3v gradient = SURFACE(leaf_gradient)(point, shape, root.leaf);
  const realv slope = abs_v(dot3(gradient, search.direction));
  const realv spread = LENS(spread)(lens, gradient);
  const real3v centre = broadcast3(lens->centre);
  const realv blur = ((realv)lens->noise + PLACED * (longest(ray->origin) + longest(centre) + t) * spread) / slope;
  const maskv grazes = not_lane(slope > (realv)GRAZES * spread);
  const realv low = grazes ? max_v(t - blur, from + root.low) : t - blur;
  const realv high = grazes ? min_v(t + blur, from + root.high) : t + blur;

  const maskv first = root.found & (not_lane(hit->found) | (high < hit->low));
  const maskv beside = root.found & not_lane(first) & not_lane(low > hit->high);
  if (!any_lane(first | beside)) return;
  maskv defined;
  const real3v outward = LENS(normal)(lens, gradient, first | beside, &defined);
  const maskv faces = LENS(faces)(outward, ray->direction, inside);
  const realv square = dot3(outward, outward);

  // Ask F where the nearest surface is met, how far from there this one is: what a long way has rounded is the same for
  // both. Surfaces in contact are one interface if they are parallel; else they meet in an edge, and which one comes first
  // is not known
  maskv contact = (maskv)0, before = (maskv)0, unknown = (maskv)0;
  realv apart = (realv)0, error = (realv)0;
  if (any_lane(beside)) {
    const realv reach = longest(hit->point) + longest(centre);
    real3v here;
    const realv f = SURFACE(leaf_f_gradient)(to_local_point(lens, hit->point), shape, root.leaf, &here);
    const realv falls = dot3(here, search.direction);
    apart = -f / falls;
    error = hit->error + ((realv)lens->noise + PLACED * reach * LENS(spread)(lens, here)) / abs_v(falls);
    const real3v across = cross3(outward, hit->normal);
    const maskv parallel = dot3(across, across) <= PARALLEL * square * dot3(hit->normal, hit->normal);
    const realv cosine = abs_v(dot3(outward, ray->direction)) / sqrt(square);
    const realv scale = longest(hit->point) + (realv)lens->size;
    const maskv close = (abs_v(apart) + error) * cosine <= CONTACT * scale;
    const maskv certain = (abs_v(apart) > error) & (not_lane(parallel) | ((abs_v(apart) - error) * cosine > APART * scale));
    contact = beside & parallel & close & not_lane(grazes) & not_lane((maskv)(MASK)!CONTACT_IS_DECIDED);
    before = beside & certain & not_lane(contact) & (apart < (realv)0);
    unknown = beside & not_lane(contact | certain);
  }
  const maskv alone = first | before;
  const maskv taken = alone | (contact & (apart < (realv)0));
  const maskv doubtful = ((alone | contact) & not_lane(defined & faces)) | unknown;
  hit->doubt = doubtful ? min_v(hit->doubt, first ? t : min_v(t, hit->t)) : hit->doubt;

  const realv turns = inside ? (realv)-1 : (realv)1;
  const real3v against = {turns * outward.x, turns * outward.y, turns * outward.z};
  hit->low = alone ? low : contact ? min_v(low, hit->low) : hit->low;
  hit->high = alone ? high : contact ? max_v(high, hit->high) : hit->high;
  const real3v place = to_world_point(lens, point);
  const realv own = ((realv)lens->noise + PLACED * (longest(place) + longest(centre)) * spread) / slope;
  hit->error = taken ? own : hit->error;
  hit->point = pick3(taken, place, hit->point);
  hit->normal = pick3(taken, against, hit->normal);
  hit->lens = taken ? (maskv)LENS_NUMBER : hit->lens;
  hit->t = taken ? t : hit->t;
  NOTE_CROSSED(hit, alone, contact);
  hit->crossed = alone ? LENS_BIT : contact ? hit->crossed | LENS_BIT : hit->crossed;
  hit->found = hit->found | first;
}
#undef PARALLEL
#undef CONTACT
#undef APART
#undef PLACED
#undef GRAZES
