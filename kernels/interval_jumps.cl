// interval_jumps.cl: sign and floor of bands, functions that jump.
//
// provides  band_sign(), band_floor(), band_floor_on(), band_either(), band_whole()
// needs     prelude, functions, jumps, interval
//
// Where a jump may lie on the segment, the band has room for both sides of it, at every place: its line takes no part in
// the jump, so it is as level as the operand's. A band that climbed with the jump would prove another sign behind it, on
// ever shorter segments, and the search would take the jump for a root.

// Half the width of a band, rounded up; 0 if it is a number known exactly, which may lie on the jump itself.
static inline realv reach_of_step(band_t a) {
  const maskv exact = (a.rise == (realv)0) & (a.error == (realv)0);
  return exact ? (realv)0 : band_reach(a);
}

static inline band_t band_sign(band_t a) {
  const realv reach = reach_of_step(a);
  const realv low = a.mid - reach;
  const realv high = a.mid + reach;
  const maskv zero = (low == (realv)0) & (high == (realv)0);
  const realv one = low > (realv)0 ? (realv)1 : (high < (realv)0 ? (realv)-1 : (realv)0);
  const maskv sure = zero | (low > (realv)0) | (high < (realv)0);
  const band_t c = {one, (realv)0, sure ? (realv)0 : (realv)1};
  return band_known(high - low < (realv)REAL_MAX, c);
}

// Between two whole numbers the band is level. Over more of them it follows the operand: a - 1 < floor(a) <= a.
static inline band_t band_floor(band_t a) {
  const realv reach = reach_of_step(a);
  const realv first = floor_v(a.mid - reach);
  const realv last = floor_v(a.mid + reach);
  const band_t level = {HALF * first + HALF * last, (realv)0,
                        first == last ? (realv)0 : ((HALF * last - HALF * first) + ROUNDING * abs_v(last)) * WIDEN};
  const band_t along = {a.mid - HALF, a.rise, (a.error + HALF + ROUNDING * (abs_v(a.mid) + HALF)) * WIDEN};
  return band_known(last - first < (realv)REAL_MAX, band_pick(last - first <= (realv)1, level, along));
}

// The same on one side of a jump, where a single one may lie on the segment.
//
//   number  of this jump, among those of a surface
//   way     its bit of that number says which side: the lower one, or the upper one
//   forks   gets the bit in lanes where there is such a jump
static inline band_t band_floor_on(band_t a, int number, int way, maskv *forks) {
  const realv reach = reach_of_step(a);
  const realv first = floor_v(a.mid - reach);
  const realv last = floor_v(a.mid + reach);
  const maskv two = last - first == (realv)1;
  *forks = two ? *forks | (maskv)(1 << number) : *forks;
  const band_t side = {((way >> number) & 1) != 0 ? last : first, (realv)0, (realv)0};
  return band_pick(two, side, band_floor(a));
}

// All that lies in the one band or in the other; in lanes where they are the same, this one.
static inline band_t band_either(band_t first, band_t second) {
  const band_t both = {
      HALF * first.mid + HALF * second.mid, HALF * first.rise + HALF * second.rise,
      (max_v(first.error, second.error) + (realv)0 * (first.error + second.error) +  // NaN, where one is unknown
       HALF * (abs_v(first.mid - second.mid) + abs_v(first.rise - second.rise)) +
       (realv)2 * ROUNDING * (abs_v(first.mid) + abs_v(second.mid) + abs_v(first.rise) + abs_v(second.rise)) +
       UNDERFLOW) *
          WIDEN};
  const maskv same = (first.mid == second.mid) & (first.rise == second.rise) & (first.error == second.error);
  return band_pick(same, first, both);
}

// The slope of an expression that contains a sign or a floor. It is unknown where that may jump: the slope does not show it.
static inline band_t band_whole(band_t step, band_t slope) {
  return band_known(step.error < (realv)NUMBER(0.25), slope);
}
