// interval_cbrt.cl: the cube root of a quadratic that is nowhere negative, on a segment of a ray, as bands.
//
// provides  cbrt_t, cbrt_of(); band_of_cbrt(), start_of_cbrt(), slope_of_cbrt()
// needs     prelude, functions, interval, interval_polynomials, interval_arithmetic, interval_curves
//
// Where such a q comes near zero its root has a cusp, and q's band says little of q^(-2/3), nothing where it reaches
// below zero. But no place of the ray makes q negative, none beyond the segment either. So with v >= 0 the least that q
// is anywhere, q'^2 = 4 c2 (q - v), and the root's slope is of the size
//
//   |q'| / (3 q^(2/3)) = 2/3 sqrt(c2) sqrt(q - v) q^(-2/3) <= 2/3 sqrt(c2) q^(-1/6),
//
// which hardly grows where q shrinks. Where v lies on the segment the middle is largest at q = 4 v, 0.6874 times
// 2/3 sqrt(c2) v^(-1/6).

#define INVERSE_CBRT_ULP 4
#define TOP_OF_CUSP ((realv)NUMBER(0.6874))  // sqrt(3) / 4^(2/3), rounded up

// The cube root of a quadratic on the segment: what the one and the other lie between. It is made once for all of its
// bands, for PoCL's compiler does not see that they have it in common.
typedef struct {
  quadratic_t of;
  realv low, high;                  // low is 0 or normal, high is normal: its doubt is
  realv at_low, at_high;            // the root there
  realv inverse_low, inverse_high;  // 1 over it; where low is 0 it means nothing
  realv chord;                      // slope of the root from low to high
} cbrt_t;

// A c2 below zero is so by rounding, 2 errors at most, and is taken as zero. At a place some ulp off the lowest, q is
// higher by their square.
static inline cbrt_t cbrt_of(quadratic_t q) {
  const realv bend = max_v(q.c[2], (realv)0);
  const realv lowest = min_v((realv)1, max_v((realv)-1, HALF * q.c[1] / bend));  // at -u
  const realv rounded = (realv)4 * ROUNDING * (abs_v(q.c[0]) + abs_v(q.c[1]) + abs_v(q.c[2]));
  const realv doubt = (realv)3 * q.error + rounded + UNDERFLOW;
  cbrt_t root;
  root.of = q;
  const realv low = q.c[0] - lowest * (q.c[1] - bend * lowest) - doubt;
  const maskv positive = low >= (realv)REAL_TINY;
  root.low = positive ? low : (realv)0;
  root.high = q.c[0] + abs_v(q.c[1]) + bend + doubt;
  const realv at_low = cbrt_normal_v(low, &root.inverse_low);
  root.at_low = positive ? at_low : (realv)0;
  root.at_high = cbrt_normal_v(root.high, &root.inverse_high);
  root.chord = (realv)1 / (root.at_low * root.at_low + root.at_low * root.at_high + root.at_high * root.at_high);
  return root;
}

// The chord and the bulge over it are those of band_cbrt().
static inline band_t band_of_cbrt(cbrt_t root) {
  const realv climb = (root.high - root.low) * root.chord;
  const realv bulge = (realv)NUMBER(0.25) * root.chord * climb * climb *
                      ((realv)NUMBER(1.5) * (root.at_low + root.at_high) +
                       (realv)NUMBER(0.083333333333333333) * climb);
  const band_t c = band_chord(band_of_quadratic(root.of), root.low, root.high, root.at_low, root.chord, bulge,
                              2 * CBRT_ULP + DIVIDE_ULP + 3);
  return band_known(root.high < (realv)REAL_MAX, c);
}

// Where the segment starts q lies within a share x of the highest that it can be, and for x <= 1/2
// (1 - x)^(1/3) >= 1 - x / 3 - x^2 / 6; else from 0 on.
static inline band_t start_of_cbrt(cbrt_t root) {
  const band_t start = start_of_quadratic(root.of);
  const realv high = band_high(start);
  const realv sixth = (realv)NUMBER(0.16666666666666667);
  realv inverse;
  const realv highest = cbrt_normal_v(high, &inverse);
  const realv square = inverse * inverse;
  const realv width = (realv)2 * band_reach(start);
  const realv x = width * (square * inverse) * LOOSEN;
  const realv fall = x <= HALF ? width * square * (sixth + sixth + sixth * x) * LOOSEN : highest;
  const band_t c = {highest - HALF * fall, (realv)0,
                    (HALF * fall + (realv)(CBRT_ULP + 2) * ROUNDING * highest) * WIDEN + UNDERFLOW};
  return band_known(high < (realv)REAL_MAX, c);
}

// q' q^(-2/3) / 3 with a chord of what q' is multiplied by: from low to high it falls by
// (1/r + 1/s) / (3 r s (r^2 + r s + s^2)) a unit of q, r and s being the roots, and a chord lies above a curve by at
// most an eighth of its width's square times the curvature, here at most 10/27 low^(-8/3). Where the segment is so long
// that this says less than the cusp's height, the latter.
static inline band_t slope_of_cbrt(cbrt_t root) {
  const quadratic_t q = root.of;
  const realv third = (realv)NUMBER(0.33333333333333333);
  const realv a = root.inverse_low, b = root.inverse_high;
  const realv share = (root.high - root.low) * a * (a * a);
  const realv bulge = (realv)NUMBER(-0.046297) * (share * a) * (share * a);
  const band_t factor = band_chord(band_of_quadratic(q), root.low, root.high, third * a * a,
                                   -third * (a + b) * (a * b) * root.chord, bulge,
                                   6 * INVERSE_CBRT_ULP + 2 * CBRT_ULP + DIVIDE_ULP + 4);
  const band_t product = band_multiply(slope_of_quadratic(q), factor);

  // Without doubt v is on the segment
  const realv bend = max_v(q.c[2], (realv)0);
  const maskv turns = abs_v(q.c[1]) + (realv)8 * q.error <= bend + bend;
  const realv top = (realv)NUMBER(0.66666666666666667) * sqrt((bend + (realv)2 * q.error) * a) *
                    (turns ? TOP_OF_CUSP : (realv)1) * LOOSEN;
  const band_t cusp = {(realv)0, (realv)0, top};
  return band_known((root.low > (realv)0) & (root.high < (realv)REAL_MAX),
                    band_pick(product.error <= top, product, cusp));
}
