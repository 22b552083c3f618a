// interval_norms.cl: (|a|^p + |b|^p)^(1/p) of bands, and its slope by a.
//
// provides  band_norm(), band_norm_slope()        needs  prelude, functions, norms, interval, interval_curves
//
// The caller promises p >= 1. The band of p may reach below 1 by rounding. The norm is convex in a and b. A change of a or b
// changes it by at most as much. A change of p changes it by at most log(2) / p^2 times that change, relatively.

#define NORM_ULP 28          // POW_ULP for one power, half of that for another one, 4 for the rest
#define SLOPE_IS_TOLD ((realv)NUMBER(0.001))  // unknown is a slope that rounding of a may change by more

// On the line mid + rise u the norm is convex. So it lies nowhere above its chord, and below the chord by at most twice the
// gap at u = 0.
static inline band_t band_norm(band_t a, band_t b, band_t p) {
  const realv value = norm_v(a.mid, b.mid, p.mid);
  const realv start = norm_v(a.mid - a.rise, b.mid - b.rise, p.mid);
  const realv end = norm_v(a.mid + a.rise, b.mid + b.rise, p.mid);
  const realv change = (abs_v(p.rise) + p.error) * WIDEN;
  const realv size = abs_v(a.mid) + abs_v(a.rise) + abs_v(b.mid) + abs_v(b.rise);
  const band_t c = {value, HALF * end - HALF * start,
                    (abs_v(HALF * end + HALF * start - value) + (a.error + b.error) +
                     ((realv)(2 * NORM_ULP) * ROUNDING + change) * (start + end) + (realv)2 * ROUNDING * size +
                     UNDERFLOW) *
                        WIDEN};
  return band_known(p.mid + change >= (realv)1, c);
}

// The slope by a, sign(a) (|a| / norm)^(p - 1). It increases with a. The larger |b|, the nearer it is to zero.
//
// Where a may be zero and p is nearly 1, the slope may change its sign within the rounding of a. Then it is unknown, even
// for a ray along the edge a = 0, whose F does not depend on it. Around a = b = 0 it may have any value from -1 to 1.
static inline band_t band_norm_slope(band_t a, band_t b, band_t p) {
  const realv low = band_low(a) - UNDERFLOW;
  const realv high = band_high(a) + UNDERFLOW;
  const realv b_low = band_low(b), b_high = band_high(b);
  const realv far = max_v(abs_v(b_low), abs_v(b_high)) + UNDERFLOW;
  const realv near = b_low > (realv)0 ? b_low : (b_high < (realv)0 ? -b_high : (realv)0);
  const realv at_low = norm_slope_v(low, low >= (realv)0 ? far : near, p.mid);
  const realv at_high = norm_slope_v(high, high >= (realv)0 ? near : far, p.mid);
  const realv change = (abs_v(p.rise) + p.error) * WIDEN;
  const realv logarithms = (realv)(sizeof(real) == 4 ? 110 : 750);  // bounds |log r|, r > 0 a number of this precision
  const band_t c = {HALF * at_low + HALF * at_high, (realv)0,
                    ((HALF * at_high - HALF * at_low) + ROUNDING * ((realv)40 + (realv)5 * p.mid) + logarithms * change) *
                        WIDEN};

  const realv own = a.error + UNDERFLOW;
  const maskv edge = (low <= (realv)0) & (high >= (realv)0) & (far > (realv)16 * (own + b.error)) &
                     (norm_slope_v(own, far, p.mid) > SLOPE_IS_TOLD);
  const maskv known = (p.mid + change >= (realv)1) & (change <= HALF) & (high - low < (realv)REAL_MAX) &
                      (b_high - b_low < (realv)REAL_MAX) & not_lane(edge);
  return band_known(known, c);
}
