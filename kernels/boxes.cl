// boxes.cl: walk a hierarchy of boxes with a packet of rays: which lenses may they meet, nearest first?
//
// provides  walk_t, walk_boxes(), next_lens()
// needs     prelude, slab, ray; lone_t, set_lone(), goes_alone(), next_of_lone() of boxes_lone.cl or boxes_packet.cl
//
// The box of a node holds those of its two children, that of a leaf one solid, in the world. The host has rounded each of
// them outwards, by far more than their corners err. A packet goes down where any lane's ray meets the box no farther away
// than its limit; where few lanes do, each of them may go on alone.

#define BOXES_DEEP 40  // nodes that wait: one a level, and the host halves the lenses from level to level
#define BOX_AXIS 3     // the bits of a link that tell the axis
#define BOX_WIDE 2     // behind them

typedef struct {
  real3v origin, inverse;  // of the rays, 1 / direction
  maskv lanes;             // that walk
  int turned;              // a bit for each axis along which most of them go downwards
  int waiting;
  int nodes[BOXES_DEEP];   // that wait, the next one last
  lone_t lone;             // lanes that go alone
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
  set_lone(&walk.lone, walk.origin, inverse);
  if (any_lane(lanes)) {
    walk.nodes[walk.waiting++] = 0;
    walk.turned = most_lanes(d.x < (realv)0, lanes) | most_lanes(d.y < (realv)0, lanes) << 1 |
                  most_lanes(d.z < (realv)0, lanes) << 2;
  }
  return walk;
}

// The lanes whose ray ahead meets the box no farther away than their limit.
static inline maskv meets_box(const walk_t *walk, global const real *box, realv limit) {
  realv enter = (realv)0, leave = (realv)REAL_MAX;
  clip_by_inverse(walk->origin.x, walk->inverse.x, (realv)box[0], (realv)box[3], &enter, &leave);
  clip_by_inverse(walk->origin.y, walk->inverse.y, (realv)box[1], (realv)box[4], &enter, &leave);
  clip_by_inverse(walk->origin.z, walk->inverse.z, (realv)box[2], (realv)box[5], &enter, &leave);
  return walk->lanes & passes_box(&enter, leave, limit);
}

// The number of the next lens that lanes may meet within their limits, with those lanes; -1 where there is none left.
static inline int next_lens(walk_t *walk, BOX_PARAMETERS, realv limit, maskv *lanes) {
  for (;;) {
    const int number = next_of_lone(&walk->lone, BOX_ARGUMENTS, limit, lanes);
    if (number >= 0) return number;
    if (walk->waiting == 0) return -1;
    const int node = walk->nodes[--walk->waiting];
    *lanes = meets_box(walk, boxes + 6 * node, limit);
    if (!any_lane(*lanes)) continue;
    const int2 link = links[node];
    if (link.x < 0) return ~link.x;
    if (goes_alone(&walk->lone, link.y >> BOX_WIDE, *lanes)) continue;
    const int high_first = walk->turned >> (link.y & BOX_AXIS) & 1;
    walk->nodes[walk->waiting++] = link.x + 1 - high_first;
    walk->nodes[walk->waiting++] = link.x + high_first;
  }
}
