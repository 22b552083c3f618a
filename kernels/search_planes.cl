// search_planes.cl: where a ray enters or leaves a convex polyhedron, by all its planes.
//
// provides  SURFACE(isolate)()        needs  prelude, functions, search, planes; SURFACE(t) with share
// source    Cyrus & Beck, Generalized two- and three-dimensional clipping, Computers & Graphics 3, 1978; Haines, Fast
//           ray-convex polyhedron intersection, Graphics Gems II, 1991. Here with a bound on every rounding
//
// A ray from outside enters through the last plane that it crosses inward, a ray inside leaves through the first that
// it crosses outward. The place that is found is then checked against all planes. Where the point lies in every other
// half space for certain, it lies in the inside of that face, and this is the first root. Where it is in front of a
// plane for certain, the ray misses: all that are crossed inward for certain are behind there, so this one is parallel,
// and in front all the way, or crossed outward, and in front from there on, while before that the last plane is. It also
// misses where the last plane is crossed behind the end of its way.
//
// Lengths along the ray are in units of `way`, its whole length, so t lies in [0, 1]. The error of a plane's value at
// o + t way is at most share + g, with share of the lane and g of the plane, the part that grows with d.

#define SURE 4    // errors: a plane whose value changes by less on the whole way is taken as parallel
#define BEFORE 16  // errors of t: a doubt begins so long before the place that is in doubt
#define FRONT 12  // errors: of a value, of a parallel plane's change, and of choosing the last plane by rounded numbers

// The second largest of the planes' values, each with its g: of a point inside a face it is negative by an error.
static inline realv SURFACE(second_value)(SURFACE(t) shape, real3v p) {
  realv most = (realv)-REAL_MAX, second = (realv)-REAL_MAX;
#pragma nounroll
  for (int k = 0; k < SURFACE(PLANES); ++k) {
    const real *plane = shape->planes + SURFACE(WORDS) * k;
    const realv value = SURFACE(value)(plane, p, plane[4]);
    second = max_v(second, min_v(most, value));
    most = max_v(most, value);
  }
  return second;
}

// Lanes whose point is in front of a plane, by FRONT errors and `moved`.
static inline maskv SURFACE(is_in_front)(SURFACE(t) shape, real3v p, realv share, realv moved) {
  const realv least = (realv)FRONT * share + moved;
  maskv front = (maskv)0;
#pragma nounroll
  for (int k = 0; k < SURFACE(PLANES); ++k) {
    const real *plane = shape->planes + SURFACE(WORDS) * k;
    front = front | (SURFACE(value)(plane, p, plane[3] + FRONT * plane[5]) > least);
  }
  return front;
}

// Lanes whose point is behind every plane for certain.
static inline maskv SURFACE(is_behind)(SURFACE(t) shape, real3v p, realv share, realv moved) {
  maskv behind = (maskv)-1;
#pragma nounroll
  for (int k = 0; k < SURFACE(PLANES); ++k) {
    const real *plane = shape->planes + SURFACE(WORDS) * k;
    behind = behind & (SURFACE(value)(plane, p, plane[4]) + share + moved < (realv)0);
  }
  return behind;
}

static inline root_t SURFACE(isolate)(search_t search, SURFACE(t) shape, const method_t *method) {
  const real3v o = search.origin;
  const realv turn = search.inside ? (realv)1 : (realv)-1;
  const real3v way = {search.direction.x * search.length, search.direction.y * search.length,
                      search.direction.z * search.length};
  const real3v turned = {turn * way.x, turn * way.y, turn * way.z};
  const realv longest = abs_v(way.x) + abs_v(way.y) + abs_v(way.z);
  const realv reach = abs_v(o.x) + abs_v(o.y) + abs_v(o.z) + longest;
  const realv share = (realv)shape->share * reach;
  const realv least = (realv)SURE * share;

  // The last plane that is crossed inward, or the first outward: of level / slope the largest. None yet is -1 / 0
  realv level = (realv)-1, slope = (realv)0, leaf = (realv)0;
#pragma nounroll
  for (int k = 0; k < SURFACE(PLANES); ++k) {
    const real *plane = shape->planes + SURFACE(WORDS) * k;
    const realv own_level = SURFACE(value)(plane, o, plane[3]);
    const realv own_slope = (realv)plane[2] * turned.z + (realv)plane[1] * turned.y + (realv)plane[0] * turned.x;
    const maskv crosses = own_slope > least + (realv)(SURE * plane[5]);
    const maskv beyond = crosses & (own_level * slope > level * own_slope);
    level = beyond ? own_level : level;
    slope = beyond ? own_slope : slope;
    leaf = beyond ? (realv)k : leaf;
  }
  const maskv crosses = slope > (realv)0;
  const realv inverse = (realv)1 / (crosses ? slope : (realv)1);
  const realv error = share + SURFACE(number_of)(shape, leaf, 5);
  const realv doubt = (realv)2 * error * inverse;  // of t
  const realv place = crosses ? -turn * level * inverse : (realv)0;
  const realv t = min_v(max_v(place, (realv)0), (realv)1);

  // Is that point in all other half spaces? If not, is it in front of one? Squares of errors and of sizes must be within
  // the range of numbers: products here lie between them
  const real3v p = at3(o, way, t);
  const realv moved = doubt * longest;
  const maskv inner = SURFACE(second_value)(shape, p) + share + moved < (realv)0;
  const maskv known = (share * share > (realv)REAL_TINY) & (reach * reach < (realv)REAL_MAX);
  const maskv ahead = crosses & (place > doubt) & (place + doubt < (realv)1);
  root_t root = no_root();
  root.steps = one_step(search.lanes);
  root.found = search.lanes & known & ahead & inner;
  const maskv may_miss = known & not_lane(search.inside), never = may_miss & (place > (realv)1 + doubt);
  root.undecided = search.lanes & not_lane(root.found | never);
  if (any_lane(root.undecided & may_miss)) {
    root.undecided = root.undecided & not_lane(may_miss & SURFACE(is_in_front)(shape, p, share, moved));
  }

  // A doubt begins where a ray inside may leave or one outside may enter: what is met before does not hang on it. A ray
  // outside is in front of the last plane up to there; one inside is in the solid if it is there, which is convex
  const maskv begins = root.undecided & known & crosses;
  realv from = (realv)0;
  if (any_lane(begins)) {
    const realv before = min_v(max_v(place - (realv)BEFORE * doubt, (realv)0), (realv)1);
    maskv sure = begins;
    if (any_lane(begins & search.inside)) {
      sure = begins & (not_lane(search.inside) | SURFACE(is_behind)(shape, at3(o, way, before), share, moved));
    }
    from = sure ? before : (realv)0;
  }
  root.t = root.low = root.high = (root.found ? t : from) * search.length;
  root.leaf = leaf;
  return root;
}
