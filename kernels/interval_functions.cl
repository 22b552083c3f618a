// interval_functions.cl: functions of bands that are neither roots nor powers.
//
// provides  band_exp(), band_log(), band_sin(), band_cos(), band_tan(), band_tanh(), band_atan2(), band_unbroken()
// needs     prelude, interval, interval_arithmetic, interval_curves, interval_powers

static inline band_t band_exp(band_t a) {
  const realv value = exp(a.mid);
  return band_bent(a, value, value, (realv)0, exp(band_high(a)), EXP_ULP);
}

static inline band_t band_log(band_t a, realv least) {
  const realv low = max_v(band_low(a), least);
  const realv steepest = (realv)1 / low;  // steepest^2 may be flushed to zero, low^2 may overflow
  const band_t bent = band_bent(a, log(a.mid), (realv)1 / a.mid, -steepest * steepest, (realv)0, LOG_ULP + DIVIDE_ULP);
  return band_known((low > (realv)0) & (a.mid >= low) & (band_high(a) < (realv)REAL_MAX), bent);
}

// The sine or cosine of a band, from value and slope at a.mid. With v = a - a.mid and |v| <= r, the band's reach, it is
// value cos(v) + slope sin(v), where
//
//   cos(v) lies in [1 - r^2 / 2, 1],   sin(v) within r^3 / 24 + r^5 / 120 of (1 - r^2 / 8) v.
//
// The band is [-1, 1] for r > 3 / 2, and where a.mid is too large to take off multiples of pi / 2 exactly.
static inline band_t band_wave(band_t a, realv value, realv slope) {
  const realv reach = band_reach(a);
  const realv square = reach * reach;
  const realv leaning = slope * ((realv)1 - (realv)NUMBER(0.125) * square);
  const realv falls = (realv)NUMBER(0.25) * square * abs_v(value);
  const realv bends = reach * square * ((realv)NUMBER(0.041666666666666667) + (realv)NUMBER(0.0083333333333333333) * square) *
                      abs_v(slope);
  const band_t near = {value - (realv)NUMBER(0.25) * square * value, leaning * a.rise,
                       (abs_v(leaning) * a.error + (falls + bends) * LOOSEN +
                        ((realv)(SIN_ULP + 3) * ROUNDING) * (abs_v(value) + abs_v(slope) * reach) + UNDERFLOW) *
                           WIDEN};
  const band_t all = {(realv)0, (realv)0, (realv)1};
  const maskv tells = (reach <= (realv)NUMBER(1.5)) & (abs_v(a.mid) <= WAVES_REACH);
  return band_known(reach < (realv)REAL_MAX, band_pick(tells, near, all));
}

static inline band_t band_sin(band_t a) { return band_wave(a, quarter_wave(a.mid, 0), quarter_wave(a.mid, 1)); }

static inline band_t band_cos(band_t a) { return band_wave(a, quarter_wave(a.mid, 1), -quarter_wave(a.mid, 0)); }

// The band's ends are less than 3 < pi apart. So a pole lies between two of low, middle and high exactly if the tangent is
// lower at the later one. Between poles the tangent's second derivative increases.
static inline band_t band_tan(band_t a) {
  const realv low = tan_v(band_low(a));
  const realv high = tan_v(band_high(a));
  const realv value = tan_v(a.mid);
  const realv curve_low = (realv)2 * low * ((realv)1 + low * low);
  const realv curve_high = (realv)2 * high * ((realv)1 + high * high);
  const band_t bent = band_bent(a, value, (realv)1 + value * value, curve_low, curve_high, 2 * TAN_ULP + 2);
  return band_known((band_reach(a) < NUMBER(1.5)) & (low <= value) & (value <= high), bent);
}

// |tanh''| <= 4 / (3 sqrt 3) = 0.7698. The error of the slope 1 - tanh^2 is at most twice that of the value. Since tanh
// increases, it also lies between its values at the ends. The narrower of both bands is returned: the second one on a long
// segment, and far from 0, where tanh is nearly constant.
static inline band_t band_tanh(band_t a) {
  const realv value = tanh(a.mid);
  const realv reach = band_reach(a);
  band_t bent = band_bent(a, value, (realv)1 - value * value, (realv)NUMBER(-0.77), (realv)NUMBER(0.77), TANH_ULP);
  bent.error = (bent.error + (realv)(2 * TANH_ULP + 2) * ROUNDING * reach) * WIDEN;
  const realv low = tanh(band_low(a));
  const realv high = tanh(band_high(a));
  const band_t between = {HALF * (low + high), (realv)0,
                          (HALF * (high - low) + (realv)(TANH_ULP + 2) * ROUNDING) * WIDEN};
  return band_known(reach < (realv)REAL_MAX, band_pick(bent.error < between.error, bent, between));
}

// The angle of the point (x.mid, y.mid), plus an arc tangent of what differs from it: in axes that are turned so that this
// point lies along x.
static inline band_t band_atan2(band_t y, band_t x) {
  const band_t along = band_add(band_scale(x, x.mid), band_scale(y, y.mid));
  const band_t across = band_subtract(band_scale(y, x.mid), band_scale(x, y.mid));
  const band_t rest = band_divide(across, along, (realv)-INFINITY);
  const realv value = atan2(y.mid, x.mid);
  const realv tangent = rest.mid;  // zero but for rounding
  const band_t turned = band_bent(rest, atan(tangent), (realv)1 / ((realv)1 + tangent * tangent), (realv)NUMBER(-0.65),
                                  (realv)NUMBER(0.65), ATAN_ULP + DIVIDE_ULP);
  band_t angle = band_shift(turned, value);
  angle.error = (angle.error + (realv)ATAN_ULP * ROUNDING * abs_v(value)) * WIDEN;

  // On the branch cut, x <= 0 and y = 0, and around the origin the angle may have any value from -pi to pi
  const maskv cut = (band_low(x) <= (realv)0) & (band_low(y) <= (realv)0) & (band_high(y) >= (realv)0);
  const band_t all = {(realv)0, (realv)0, (realv)NUMBER(3.1415928)};
  const maskv bounded = (band_reach(y) < (realv)REAL_MAX) & (band_reach(x) < (realv)REAL_MAX);
  const maskv sure = not_lane(cut) & (band_low(along) > (realv)0) & (angle.error < (realv)NUMBER(3.0));
  return band_known(bounded, band_pick(sure, angle, all));
}

// The slope of an expression that contains atan2. It is unknown where the angle may jump on its branch cut: the slope does
// not show the jump.
static inline band_t band_unbroken(band_t angle, band_t slope) {
  return band_known(angle.error < (realv)NUMBER(3.0), slope);
}
