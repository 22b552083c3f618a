// interval_powers.cl: quotients, roots and powers of bands.
//
// provides  band_bent(), the *_ULP; band_reciprocal(), band_divide(), band_sqrt(), band_cbrt(), band_hypot(), band_pow()
// needs     prelude, interval, interval_arithmetic
//
// least: the operand is never below it, as is known of the expression; so only rounding and bending lead there.

// Relative errors of OpenCL's functions in units of ROUNDING (ulp; full profile, OpenCL C 1.2, table 7.1; division and
// sqrt are exact in double, 2.5 and 3 ulp in single), and of the prelude's cube root
#define DIVIDE_ULP 3
#define SQRT_ULP 3
#define CBRT_ULP 2
#define EXP_ULP 3
#define LOG_ULP 3
#define SIN_ULP 4
#define TAN_ULP 5
#define ATAN_ULP 6
#define TANH_ULP 5
#define POW_ULP 16

// g(a) = value + slope (a - mid) + c (a - mid)^2 / 2, where g'' is c, between curve_low and curve_high over the band.
//
//   ulps   bounds the relative errors of value and slope; curve_low and curve_high may be wrong by 60
static inline band_t band_bent(band_t a, realv value, realv slope, realv curve_low, realv curve_high, int ulps) {
  const realv reach = band_reach(a);
  const realv half_square = HALF * reach * reach * LOOSEN;
  const realv below = curve_low < (realv)0 ? curve_low * half_square : (realv)0;
  const realv above = curve_high > (realv)0 ? curve_high * half_square : (realv)0;
  const realv bend = above - below;
  const band_t c = {value + HALF * (below + above), slope * a.rise,
                    (abs_v(slope) * a.error + (HALF + (realv)4 * ROUNDING) * bend +
                     ((realv)(ulps + 2) * ROUNDING) * (abs_v(value) + abs_v(slope) * reach) +
                     (UNDERFLOW + UNDERFLOW * reach)) *
                        WIDEN};
  return c;
}

// 1 / a, of one sign. least: a is never below it.
static inline band_t band_reciprocal(band_t a, realv least) {
  const realv low = max_v(band_low(a), least);
  const realv high = band_high(a);
  const realv near = low > (realv)0 ? low : high;
  const realv value = (realv)1 / a.mid;
  const realv curve = (realv)2 / (near * near * near);
  const band_t bent = band_bent(a, value, -value * value, curve, curve, 2 * DIVIDE_ULP + 1);
  const maskv one_sign = ((low > (realv)0) & (a.mid >= low)) | (high < (realv)0);
  return band_known(one_sign & (high < (realv)REAL_MAX) & (low > (realv)-REAL_MAX), bent);
}

// a / b = q + (a - q b) / b with q = a.mid / b.mid: what is left is small, so that little is lost by the reciprocal.
static inline band_t band_divide(band_t a, band_t b, realv least) {
  const realv q = a.mid / b.mid;
  const band_t left = band_subtract(a, band_scale(b, q));
  return band_shift(band_multiply(left, band_reciprocal(b, least)), q);
}

static inline band_t band_sqrt(band_t a, realv least) {
  const realv low = max_v(band_low(a), least);
  const realv high = band_high(a);
  const realv root_low = sqrt(low);
  const realv value = sqrt(a.mid);
  const band_t bent = band_bent(a, value, HALF / value, (realv)NUMBER(-0.25) / (low * root_low), (realv)0,
                                SQRT_ULP + DIVIDE_ULP);

  // Near zero, where the slope is unbounded, take the range. The curve is a better bound from low = high / 16 on
  const band_t range = band_between(low > (realv)0 ? root_low : (realv)0, sqrt(high), SQRT_ULP);
  return band_known((low >= (realv)0) & (high < (realv)REAL_MAX),
                    band_pick(((realv)16 * low > high) & (a.mid >= low), bent, range));
}

static inline band_t band_cbrt(band_t a) {
  const realv low = band_low(a);
  const realv high = band_high(a);
  const realv root_low = cbrt_v(low);
  const realv root_high = cbrt_v(high);
  const realv value = cbrt_v(a.mid);
  const realv near = low > (realv)0 ? root_low : root_high;  // the end nearer to zero
  const realv near_squared = near * near;
  const realv curve = (realv)NUMBER(-0.22222222222222222) / (near_squared * near_squared * near);
  const band_t bent = band_bent(a, value, (realv)1 / ((realv)3 * value * value), curve, curve,
                                3 * CBRT_ULP + DIVIDE_ULP + 2);
  const band_t range = band_between(root_low, root_high, CBRT_ULP);
  const maskv away = ((realv)16 * low > high) | ((realv)16 * high < low);
  return band_known((low > (realv)-REAL_MAX) & (high < (realv)REAL_MAX), band_pick(away, bent, range));
}

static inline band_t band_hypot(band_t a, band_t b) {
  return band_sqrt(band_add(band_square(a), band_square(b)), (realv)0);
}

// a^p, a >= 0. It rises or falls with a all the way, and so does its curvature.
static inline band_t band_pow(band_t a, band_t p, realv least) {
  const realv low = max_v(band_low(a), max_v(least, (realv)0));
  const realv high = band_high(a);
  const realv value = pow_v(a.mid, p.mid);
  const realv at_low = pow_v(low, p.mid);
  const realv at_high = pow_v(high, p.mid);

  // Another exponent changes a^p by a factor between 1 - 2 s and 1 + 2 s, s = |log a| |its change| <= 1 / 2
  const realv change = (abs_v(p.rise) + p.error) * WIDEN;
  const realv log_low = low > (realv)0 ? log(low) : (realv)0;
  const realv s = change * max_v(abs_v(log(high)), abs_v(log_low)) * LOOSEN;
  const maskv known = (low >= (realv)0) & ((band_low(a) >= (realv)0) | (least >= (realv)0)) & (high < (realv)REAL_MAX) & (s <= HALF) &
                      ((low > (realv)0) | (p.mid > change));

  const realv factor = p.mid * (p.mid - (realv)1);
  const realv curve_low = factor * at_low / (low * low);
  const realv curve_high = factor * at_high / (high * high);
  band_t bent = band_bent(a, value, p.mid * value / a.mid, min_v(curve_low, curve_high), max_v(curve_low, curve_high),
                          POW_ULP + DIVIDE_ULP + 2);
  bent.error = (bent.error + (realv)2 * s * max_v(at_low, at_high) * LOOSEN) * WIDEN;

  // Near zero, where the curvature may be unbounded, take the range
  const maskv rises = p.mid > (realv)0;
  const realv less = (realv)1 - (realv)2 * s;
  const realv more = ((realv)1 + (realv)2 * s) * WIDEN;
  const band_t range = band_between((rises ? at_low : at_high) * less, (rises ? at_high : at_low) * more, POW_ULP + 4);
  return band_known(known, band_pick(((realv)16 * low > high) & (a.mid >= low), bent, range));
}
