// interval.cl: bounds of an expression on a segment of a ray: a band about a straight line.
//
// provides  band_t; coordinate_error(); band_reach(), band_low(), band_high(), band_pick(), band_between(), band_known(),
//           band_settled(), band_top(), band_or_sign()
// needs     prelude; REAL_EPSILON, REAL_TINY
// source    affine arithmetic cut down to one shared term: Knoll, Hijazi, Kensler, Schott, Hansen, Hagen, Fast ray
//           tracing of arbitrary implicit surfaces with interval and affine arithmetic, CGF 28(1), 2009
//
// The parameter u runs from -1 at the segment's start to 1 at its end. At every real u in [-1, 1], the exact value of the
// expression differs from mid + rise u by at most error. The line holds the linear part of the expression, so error
// shrinks with the square of the segment's length. The width of a plain interval shrinks with the length only.
//
// OpenCL has no directed rounding. So each operation (interval_*.cl) adds a bound on its own rounding to error:
//
//   ROUNDING (twice the unit roundoff) times the magnitudes that it adds up: one rounding of mid and one of rise. Products
//     and functions state what they add to that
//   the factor WIDEN: at most 16 roundings of the sums of positive terms that make up error itself
//   UNDERFLOW: at most 16 results that are flushed to zero. Each of them loses less than the smallest normal number
//
// A band is unknown if mid, rise or error is infinite or NaN. An unknown band bounds nothing, even if two of the three are
// finite. Three rules keep it unknown:
//
//   1. The result of an operation is unknown if an operand is unknown. The one exception is band_where(): where its
//      condition is proved, it returns that branch, and the other branch may be unknown
//   2. A proof is a comparison that is true, since a comparison with NaN is false. min_v(a, b) and max_v(a, b) are no
//      proofs: they return a if b is NaN. So b must not be NaN, or error must become NaN or infinite with it
//   3. F's max and min join bounds of the leaves by min_v() and max_v(). An unknown leaf first goes through
//      band_settled(), which gives it the bounds -infinity and infinity instead of NaN

#define ROUNDING ((realv)REAL_EPSILON)
#define WIDEN ((realv)(1 + 8 * REAL_EPSILON))
#define LOOSEN ((realv)(1 + 64 * REAL_EPSILON))  // for up to 128 roundings, as in bounds of curvature
#define UNDERFLOW ((realv)(16 * REAL_TINY))
#define HALF ((realv)NUMBER(0.5))

typedef struct {
  realv mid, rise, error;
} band_t;

// The largest distance of a band's values from mid, rounded up.
static inline realv band_reach(band_t a) { return (abs_v(a.rise) + a.error) * WIDEN + ROUNDING * abs_v(a.mid); }

static inline realv band_low(band_t a) { return a.mid - band_reach(a); }

static inline realv band_high(band_t a) { return a.mid + band_reach(a); }

static inline band_t band_pick(maskv m, band_t a, band_t b) {
  const band_t c = {m ? a.mid : b.mid, m ? a.rise : b.rise, m ? a.error : b.error};
  return c;
}

// All values between low and high, each of which may be wrong by `ulps` ulp.
static inline band_t band_between(realv low, realv high, int ulps) {
  const band_t c = {HALF * low + HALF * high, (realv)0,
                    ((HALF * high - HALF * low) + (realv)(ulps + 1) * ROUNDING * (abs_v(low) + abs_v(high))) * WIDEN +
                        UNDERFLOW};
  return c;
}

// The same band in the lanes of `known`, an unknown band in the others.
static inline band_t band_known(maskv known, band_t a) {
  const band_t c = {a.mid, a.rise, known ? a.error : (realv)INFINITY};
  return c;
}

// The same band; an unknown one becomes 0 with infinite error.
static inline band_t band_settled(band_t a) {
  const maskv known = abs_v(a.mid) + abs_v(a.rise) + a.error < (realv)INFINITY;
  const band_t c = {known ? a.mid : (realv)0, known ? a.rise : (realv)0, known ? a.error : (realv)INFINITY};
  return c;
}

// A bound on the error of a coordinate o + t d, t in [0, 1]: one rounding of o, two of t d and one of the sum.
static inline realv coordinate_error(realv o, realv d) {
  return (realv)(1 + INPUT_ROUNDINGS) * ROUNDING * (abs_v(o) + (realv)2 * abs_v(d)) + UNDERFLOW;
}

// The upper bound of a band, as a band without width. It is raised to at least `smallest`, so that the curvature of a
// function near its pole does not overflow. It is unknown if the band is.
static inline band_t band_top(band_t a) {
  const realv smallest = (realv)16 / sqrt((realv)REAL_MAX);
  const band_t c = {max_v(band_high(a), smallest), (realv)0, (realv)0 * a.error};
  return c;
}

// The band of a leaf of F that may go to infinity on the segment. If that band is unknown, the result says the leaf's sign.
//
//   falls  whether the leaf goes to minus infinity (else to infinity)
//   bound  the band of an upper bound of the leaf if it falls, else of a lower bound
//
// A negative upper bound proves a negative sign, a positive lower bound a positive one. The result is then the largest
// number with that sign: interval_leaf.cl takes no number beyond LARGEST for the leaf's value.
static inline band_t band_or_sign(band_t a, band_t bound, bool falls) {
  const realv far = falls ? band_high(bound) : band_low(bound);
  const maskv told = falls ? far < (realv)0 : far > (realv)0;
  const band_t sign = {falls ? (realv)-REAL_MAX : (realv)REAL_MAX, (realv)0, told ? (realv)0 : (realv)INFINITY};
  return band_pick(a.error < (realv)REAL_MAX, a, sign);
}
