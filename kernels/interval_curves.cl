// interval_curves.cl: a function of a band, from bounds of its second derivative or from its chord.
//
// provides  the *_ULP; band_bent(), band_chord()        needs  prelude, interval

// Relative errors of OpenCL's functions in units of ROUNDING (ulp; full profile, OpenCL C 1.2, table 7.1; division and
// sqrt are exact in double, 2.5 and 3 ulp in single), and of our own cube root and tangent
#define DIVIDE_ULP 3
#define SQRT_ULP 3
#define CBRT_ULP 2
#define EXP_ULP 3
#define LOG_ULP 3
#define SIN_ULP 4
#define TAN_ULP 8
#define ATAN_ULP 6
#define TANH_ULP 5
#define POW_ULP 16

// g(a) = value + slope (a - mid) + c (a - mid)^2 / 2. Over the band, g'' and so c lie between curve_low and curve_high.
//
//   ulps   bounds the relative errors of value and slope. Those of curve_low and curve_high may be 60 ulp
//
// Value, slope and curvature may each have been flushed to zero. The loss is multiplied as they are: by 1, by reach and by
// half_square.
static inline band_t band_bent(band_t a, realv value, realv slope, realv curve_low, realv curve_high, int ulps) {
  const realv reach = band_reach(a);
  const realv half_square = HALF * reach * reach * LOOSEN + (realv)REAL_TINY;  // the product may be flushed to zero
  const realv below = curve_low < (realv)0 ? curve_low * half_square : (realv)0;
  const realv above = curve_high > (realv)0 ? curve_high * half_square : (realv)0;
  const realv bend = above - below;
  const band_t c = {value + HALF * (below + above), slope * a.rise,
                    (abs_v(slope) * a.error + (HALF + (realv)4 * ROUNDING) * bend +
                     ((realv)(ulps + 2) * ROUNDING) * (abs_v(value) + abs_v(slope) * reach) +
                     UNDERFLOW * ((realv)1 + reach + half_square)) *
                        WIDEN};
  return c;
}

// A function on [low, high] whose graph lies between its chord and the tangent parallel to it.
//
//   value  the function at low
//   slope  of the chord
//   bulge  how far the tangent lies above the chord; negative if it lies below
//   ulps   bounds the relative errors of value and slope
static inline band_t band_chord(band_t a, realv low, realv high, realv value, realv slope, realv bulge, int ulps) {
  const realv climb = abs_v(slope) * (high - low);
  const band_t c = {value + slope * (a.mid - low) + HALF * bulge, slope * a.rise,
                    (abs_v(slope) * a.error + (HALF * LOOSEN) * abs_v(bulge) +
                     ((realv)(ulps + 6) * ROUNDING) * (abs_v(value) + climb) + UNDERFLOW) *
                        WIDEN};
  return c;
}
