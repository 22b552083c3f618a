// interval_cbrt.cl: the cube root of a quadratic that is nowhere negative, on a segment of a ray, as bands.
//
// provides  cbrt_t, cbrt_of(); band_of_cbrt(), start_of_cbrt(), slope_of_cbrt()
// needs     prelude, functions, interval, interval_polynomials, interval_arithmetic, interval_curves
//
// Near a zero of such a q its root has a cusp. There q's band gives a wide bound on q^(-2/3), and none if it reaches below
// zero. But q is negative nowhere on the ray, also beyond the segment. Let v >= 0 be the least value of q on the whole ray.
// Then q'^2 = 4 c2 (q - v), and the size of the root's slope is
//
//   |q'| / (3 q^(2/3)) = 2/3 sqrt(c2) sqrt(q - v) q^(-2/3) <= 2/3 sqrt(c2) q^(-1/6),
//
// which grows slowly as q shrinks. If q takes the value v on the segment, the middle term is largest at q = 4 v: it is
// 0.6874 times 2/3 sqrt(c2) v^(-1/6) there.

#define INVERSE_CBRT_ULP 4
#define TOP_OF_CUSP ((realv)NUMBER(0.6874))  // sqrt(3) / 4^(2/3), rounded up

// Bounds of a quadratic on the segment, and of its cube root. They are computed once for all bands of the root, since PoCL's
// compiler does not see that the bands have them in common.
typedef struct {
  quadratic_t of;
  realv low, high;                  // of the quadratic; low is 0 or normal, high is normal as its error is
  realv at_low, at_high;            // the cube roots of low and high
  realv inverse_low, inverse_high;  // the reciprocals of these; without meaning where low is 0
  realv chord;                      // slope of the root from low to high
} cbrt_t;

// A c2 below zero is so by rounding, by at most 2 errors, and is taken as zero. A few ulp away from the lowest place, q is
// higher by c2 times the square of that distance.
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

// Let h be the upper bound of q at the segment's start, and (1 - x) h the lower bound. For x <= 1 / 2,
// (1 - x)^(1/3) >= 1 - x / 3 - x^2 / 6. For a larger x the lower bound of the root is 0.
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

// The slope is q' times the factor q^(-2/3) / 3, which is bounded by its chord over [low, high]. With r and s the roots of low
// and high, the chord falls by (1/r + 1/s) / (3 r s (r^2 + r s + s^2)) a unit of q. A chord lies above a curve by at most an
// eighth of the width's square times the second derivative, here at most 10/27 low^(-8/3). On a long segment the cusp's bound
// above is the narrower one, and is taken.
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

  // Lanes where q is proved to take the value v on the segment
  const realv bend = max_v(q.c[2], (realv)0);
  const maskv turns = abs_v(q.c[1]) + (realv)8 * q.error <= bend + bend;
  const realv top = (realv)NUMBER(0.66666666666666667) * sqrt((bend + (realv)2 * q.error) * a) *
                    (turns ? TOP_OF_CUSP : (realv)1) * LOOSEN;
  const band_t cusp = {(realv)0, (realv)0, top};
  return band_known((root.low > (realv)0) & (root.high < (realv)REAL_MAX),
                    band_pick(product.error <= top, product, cusp));
}
