// boxes.cl: walk a hierarchy of boxes with a packet of rays: which lenses may they meet, nearest first?
//
// provides  walk_t, walk_boxes(), next_lens()
// needs     prelude, functions, ray
//
// The box of a node holds those of its two children, that of a leaf one solid, in the world. The host has rounded each of
// them outwards, by far more than their corners err. A packet goes down where any lane's ray meets the box no farther away
// than its limit.
//
// A ray meets the slab between two planes over o + t d = low and high. Of both ends, t is (low - o) (1 / d): one
// subtraction, one reciprocal, which may err by 2.5 ulp, one product. Each is off by 3.5 roundings at most, its sign is
// right, and nothing is smaller than numbers can be: where low is not o, the host's margin keeps them apart by more. So
// the way through the box is made longer by 5 roundings at either end, one of which is that of doing so. A ray along the
// slab has an infinite 1 / d: both ends are infinite, on two sides of it inside, on one side outside. On a face of the box
// 0 times infinity is no number, which limits nothing or leaves the ray out: either is right, for the solids do not reach
// the faces.

#define BOXES_DEEP 40  // nodes that wait: one a level, and the host halves the lenses from level to level
#define BOX_MARGIN (5 * (real)REAL_EPSILON)

typedef struct {
  real3v origin, inverse;  // of the rays, 1 / direction
  maskv lanes;             // that walk
  int turned;              // a bit for each axis along which most of them go downwards
  int waiting;
  int nodes[BOXES_DEEP];   // that wait, the next one last
} walk_t;

static inline int most_lanes(maskv some, maskv all) { return 2 * count_lanes(some & all) > count_lanes(all); }

static inline walk_t walk_boxes(const ray_t *ray, maskv lanes) {
  const real3v d = ray->direction;
  const real3v inverse = {(realv)1 / d.x, (realv)1 / d.y, (realv)1 / d.z};
  walk_t walk;
  walk.origin = ray->origin;
  walk.inverse = inverse;
  walk.lanes = lanes;
  walk.turned = walk.waiting = 0;
  if (any_lane(lanes)) {
    walk.nodes[walk.waiting++] = 0;
    walk.turned = most_lanes(d.x < (realv)0, lanes) | most_lanes(d.y < (realv)0, lanes) << 1 |
                  most_lanes(d.z < (realv)0, lanes) << 2;
  }
  return walk;
}

static inline void clip_by_inverse(realv o, realv inverse, real low, real high, realv *enter, realv *leave) {
  const realv a = ((realv)low - o) * inverse;
  const realv b = ((realv)high - o) * inverse;
  *enter = max_v(*enter, min_v(a, b));
  *leave = min_v(*leave, max_v(a, b));
}

// The lanes whose ray ahead meets the box no farther away than their limit.
static inline maskv meets_box(const walk_t *walk, global const real *box, realv limit) {
  realv enter = (realv)0, leave = (realv)REAL_MAX;
  clip_by_inverse(walk->origin.x, walk->inverse.x, box[0], box[3], &enter, &leave);
  clip_by_inverse(walk->origin.y, walk->inverse.y, box[1], box[4], &enter, &leave);
  clip_by_inverse(walk->origin.z, walk->inverse.z, box[2], box[5], &enter, &leave);
  enter = enter * (realv)((real)1 - BOX_MARGIN);
  leave = leave * (realv)((real)1 + BOX_MARGIN);
  return walk->lanes & (enter <= leave) & (enter <= limit);
}

// The number of the next lens that lanes may meet within their limits, with those lanes; -1 where there is none left.
static inline int next_lens(walk_t *walk, global const real *boxes, global const int2 *links, realv limit,
                            maskv *lanes) {
  while (walk->waiting > 0) {
    const int node = walk->nodes[--walk->waiting];
    *lanes = meets_box(walk, boxes + 6 * node, limit);
    if (!any_lane(*lanes)) continue;
    const int2 link = links[node];
    if (link.x < 0) return ~link.x;
    const int high_first = walk->turned >> link.y & 1;
    walk->nodes[walk->waiting++] = link.x + 1 - high_first;
    walk->nodes[walk->waiting++] = link.x + high_first;
  }
  return -1;
}
#undef BOX_MARGIN
