// boxes_lone.cl: where few lanes of a packet go into a node, each goes alone, and meets as many boxes at a time as a
// packet has lanes: rays that go apart would else wait for each other at every box.
//
// provides  lone_t, set_lone(), goes_alone(), next_of_lone()        needs  prelude, functions, slab
// source    Benthin, Wald, Woop, Ernst, Mark, Combining single and packet-ray tracing for arbitrary ray distributions on
//           the Intel MIC architecture, IEEE TVCG 18(9), 2012
//
// A wide node holds VW boxes of the hierarchy, some levels below one node: the lowest x of all, the lowest y, and so on.
// Its links are other wide nodes, or ~number of a lens. Where it has fewer, boxes are at infinity: no ray meets them.

#define LONE_MOST (VW / 2)        // lanes that go alone together
#define LONE_DEEP (VW + 10 * VW)  // nodes that wait: of each level VW - 1, and at first one a lane

typedef struct {
  real origin[3][VW], inverse[3][VW];
  int waiting;
  int nodes[LONE_DEEP];   // that wait, the next one last
  int lanes[LONE_DEEP];   // whose
  real enters[LONE_DEEP]; // where it enters the box
} lone_t;

typedef union {
  maskv mask;
  MASK lanes[VW];
} lone_lanes_t;

static inline void set_lone(lone_t *lone, real3v origin, real3v inverse) {
  lone->waiting = 0;
  store_lanes(origin.x, lone->origin[0]);
  store_lanes(origin.y, lone->origin[1]);
  store_lanes(origin.z, lone->origin[2]);
  store_lanes(inverse.x, lone->inverse[0]);
  store_lanes(inverse.y, lone->inverse[1]);
  store_lanes(inverse.z, lone->inverse[2]);
}

// Let lanes go into a wide node alone if they are few; says whether. -1 stands for no such node.
static inline int goes_alone(lone_t *lone, int wide, maskv lanes) {
  if (wide < 0 || count_lanes(lanes) > LONE_MOST) return 0;
  lone_lanes_t goes;
  goes.mask = lanes;
  for (int lane = 0; lane < VW; ++lane) {
    if (!goes.lanes[lane]) continue;
    lone->nodes[lone->waiting] = wide;
    lone->lanes[lone->waiting] = lane;
    lone->enters[lone->waiting++] = (real)0;
  }
  return 1;
}

static inline void clip_lone(const lone_t *lone, int axis, int lane, global const real *boxes, realv *enter,
                             realv *leave) {
  global const realv *sides = (global const realv *)boxes;
  clip_by_inverse((realv)lone->origin[axis][lane], (realv)lone->inverse[axis][lane], sides[axis], sides[axis + 3],
                  enter, leave);
}

// Put the boxes that the lane meets on top of those that wait, the nearest last.
static inline void open_wide(lone_t *lone, int lane, global const real *boxes, global const int *links, real limit) {
  realv enter = (realv)0, leave = (realv)REAL_MAX;
  for (int axis = 0; axis < 3; ++axis) clip_lone(lone, axis, lane, boxes, &enter, &leave);
  lone_lanes_t meets;
  meets.mask = passes_box(&enter, leave, (realv)limit);
  if (!any_lane(meets.mask)) return;
  real enters[VW];
  store_lanes(enter, enters);
  const int first = lone->waiting;
  for (int i = 0; i < VW; ++i) {
    if (!meets.lanes[i]) continue;
    int place = lone->waiting++;
    for (; place > first && lone->enters[place - 1] < enters[i]; --place) {
      lone->nodes[place] = lone->nodes[place - 1];
      lone->enters[place] = lone->enters[place - 1];
    }
    lone->nodes[place] = links[i];
    lone->enters[place] = enters[i];
    lone->lanes[lone->waiting - 1] = lane;
  }
}

// The next lens that a lane may meet, with that lane; -1 where none goes alone any more.
static inline int next_of_lone(lone_t *lone, BOX_PARAMETERS, realv limit, maskv *lanes) {
  if (lone->waiting == 0) return -1;
  real limits[VW];
  store_lanes(limit, limits);
  while (lone->waiting > 0) {
    const int node = lone->nodes[--lone->waiting], lane = lone->lanes[lone->waiting];
    if (lone->enters[lone->waiting] > limits[lane]) continue;
    if (node < 0) {
      *lanes = LANES == (realv)(real)lane;
      return ~node;
    }
    open_wide(lone, lane, wide_boxes + 6 * VW * node, wide_links + VW * node, limits[lane]);
  }
  return -1;
}
