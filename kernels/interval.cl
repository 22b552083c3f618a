// interval.cl: all that an expression can be on a segment of a ray, as a band about a straight line.
//
// provides  band_t; coordinate_error(); band_reach(), band_low(), band_high(), band_pick(), band_between(), band_known(),
//           band_settled(), band_top(), band_or_sign()
// needs     prelude; REAL_EPSILON, REAL_TINY
// source    affine arithmetic cut down to one shared term: Knoll, Hijazi, Kensler, Schott, Hansen, Hagen, Fast ray
//           tracing of arbitrary implicit surfaces with interval and affine arithmetic, CGF 28(1), 2009
//
// A segment is seen from its middle: u = -1 where it starts, 1 where it ends. The value of an expression at u differs
// from mid + rise u by at most error; at every real place of the segment, in exact arithmetic. Since the line keeps
// what the parts have in common, error shrinks with the square of the segment's length; for plain intervals, with the
// length. There is no directed rounding in OpenCL, so each operation (interval_*.cl) adds to error what its own rounding can be:
//
//   ROUNDING (twice the unit roundoff) of the magnitudes that it adds up: one rounding of the line's two numbers;
//     products and functions say what more
//   the factor WIDEN for the sums of positive terms that make up error itself: not more than 16 roundings
//   UNDERFLOW: not more than 16 results that are flushed to zero, of which each loses less than the smallest normal
//
// Unknown is a band of which any of the three numbers is infinite or NaN: then none of them says anything. An unknown
// stays one by three rules:
//
//   every operation on an unknown band gives an unknown one; of a choice, of which one operand is not taken, the other
//   a proof is a comparison that holds, for one with NaN never does. min_v() and max_v() are none, and lose a NaN that is
//     their second operand: that must be a number, or stand in the error as well
//   leaves are settled before F's max and min join what is known of their ends: an unknown one lies between -infinity and
//     infinity, of which min_v() and max_v() take the right one on either side

#define ROUNDING ((realv)REAL_EPSILON)
#define WIDEN ((realv)(1 + 8 * REAL_EPSILON))
#define LOOSEN ((realv)(1 + 64 * REAL_EPSILON))  // for what takes up to 128 roundings: bounds of curvature
#define UNDERFLOW ((realv)(16 * REAL_TINY))
#define HALF ((realv)NUMBER(0.5))

typedef struct {
  realv mid, rise, error;
} band_t;

// How far a band reaches from mid, rounded up.
static inline realv band_reach(band_t a) { return (abs_v(a.rise) + a.error) * WIDEN + ROUNDING * abs_v(a.mid); }

static inline realv band_low(band_t a) { return a.mid - band_reach(a); }

static inline realv band_high(band_t a) { return a.mid + band_reach(a); }

static inline band_t band_pick(maskv m, band_t a, band_t b) {
  const band_t c = {m ? a.mid : b.mid, m ? a.rise : b.rise, m ? a.error : b.error};
  return c;
}

// Everything between two numbers that are each wrong by at most so many ulp.
static inline band_t band_between(realv low, realv high, int ulps) {
  const band_t c = {HALF * low + HALF * high, (realv)0,
                    ((HALF * high - HALF * low) + (realv)(ulps + 1) * ROUNDING * (abs_v(low) + abs_v(high))) * WIDEN +
                        UNDERFLOW};
  return c;
}

// The same band, or nothing known outside the lanes.
static inline band_t band_known(maskv known, band_t a) {
  const band_t c = {a.mid, a.rise, known ? a.error : (realv)INFINITY};
  return c;
}

// The same band, or 0 within infinity where any of its numbers is none.
static inline band_t band_settled(band_t a) {
  const maskv known = abs_v(a.mid) + abs_v(a.rise) + a.error < (realv)INFINITY;
  const band_t c = {known ? a.mid : (realv)0, known ? a.rise : (realv)0, known ? a.error : (realv)INFINITY};
  return c;
}

// What a coordinate o + t d may be wrong by, t in [0, 1]: roundings of o, of t d twice and of the sum.
static inline realv coordinate_error(realv o, realv d) {
  return (realv)(1 + INPUT_ROUNDINGS) * ROUNDING * (abs_v(o) + (realv)2 * abs_v(d)) + UNDERFLOW;
}

// A number that a band holds no more than, of a size whose square has a reciprocal: along a pole the band is all but 0.
static inline band_t band_top(band_t a) {
  const realv small = sqrt((realv)REAL_TINY) * (realv)1048576;
  const band_t c = {max_v(band_high(a), small), (realv)0, (realv)0 * a.error};
  return c;
}

// A leaf of F that goes to infinity on the segment: its band, or where that tells nothing its sign. falls: the leaf goes to
// minus infinity, and never is above `bound`; else to infinity, and never below. The sign is a band of the largest number, so
// that nobody takes it for what the leaf is.
static inline band_t band_or_sign(band_t a, band_t bound, bool falls) {
  const realv far = falls ? band_high(bound) : band_low(bound);
  const maskv told = falls ? far < (realv)0 : far > (realv)0;
  const band_t sign = {falls ? (realv)-REAL_MAX : (realv)REAL_MAX, (realv)0, told ? (realv)0 : (realv)INFINITY};
  return band_pick(a.error < (realv)REAL_MAX, a, sign);
}
