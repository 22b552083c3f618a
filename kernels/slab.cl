// slab.cl: whether a ray passes through a box, for a packet of rays and one box, or of boxes and one ray.
//
// provides  clip_by_inverse(), passes_box(), BOX_PARAMETERS, BOX_ARGUMENTS        needs  prelude, functions
//
// A ray meets the slab between two planes over o + t d = low and high. Of both ends, t is (low - o) (1 / d): one
// subtraction, one reciprocal, which may err by 2.5 ulp, one product. Each is off by 3.5 roundings at most, its sign is
// right, and nothing is smaller than numbers can be: where low is not o, the host's margin keeps them apart by more. So
// the way through the box is made longer by 5 roundings at either end, one of which is that of doing so. A ray along the
// slab has an infinite 1 / d: both ends are infinite, on two sides of it inside, on one side outside. On a face of the box
// 0 times infinity is no number, which limits nothing or leaves the ray out: either is right, for the solids do not reach
// the faces.

#define BOX_PARAMETERS                                                                                      \
  global const real *restrict boxes, global const int2 *restrict links, global const real *restrict wide_boxes, \
      global const int *restrict wide_links
#define BOX_ARGUMENTS boxes, links, wide_boxes, wide_links
#define BOX_MARGIN (5 * (real)REAL_EPSILON)

static inline void clip_by_inverse(realv o, realv inverse, realv low, realv high, realv *enter, realv *leave) {
  const realv a = (low - o) * inverse;
  const realv b = (high - o) * inverse;
  *enter = max_v(*enter, min_v(a, b));
  *leave = min_v(*leave, max_v(a, b));
}

// The lanes that enter before they leave, no farther away than the limit, a number; enter becomes what is certain of it.
static inline maskv passes_box(realv *enter, realv leave, realv limit) {
  *enter = *enter * (realv)((real)1 - BOX_MARGIN);
  return (*enter <= leave * (realv)((real)1 + BOX_MARGIN)) & (*enter <= limit);
}
