// interval_norms.cl: (|a|^p + |b|^p)^(1/p) of bands, and its slope.
//
// provides  band_norm(), band_norm_slope()        needs  prelude, functions, norms, interval, interval_curves
//
// p >= 1 is promised; what its band reaches below 1 is rounding. Then the norm is convex, and no operand changes it by
// more than its own change. Another exponent changes it by at most log(2) / p^2 of itself.

#define NORM_ULP 28          // one power, POW_ULP, half of another one, and 4
#define SLOPE_IS_TOLD ((realv)NUMBER(0.001))  // a slope that rounding of its operand changes by more has no digits

// Along the middle line the norm is convex: nowhere above its chord, and below by twice what it is in the middle at most.
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

// The slope by a, sign(a) (|a| / norm)^(p - 1): it rises with a, and is nearer to zero the larger |b| is.
//
// Where a may be zero and p is nearly 1 the slope turns over within a's rounding: then it is not known, not even for a ray
// along the edge, on which it does not matter how F changes across. About a = b = 0 it may be anything from -1 to 1.
static inline band_t band_norm_slope(band_t a, band_t b, band_t p) {
  const realv low = band_low(a) - UNDERFLOW;
  const realv high = band_high(a) + UNDERFLOW;
  const realv b_low = band_low(b), b_high = band_high(b);
  const realv far = max_v(abs_v(b_low), abs_v(b_high)) + UNDERFLOW;
  const realv near = b_low > (realv)0 ? b_low : (b_high < (realv)0 ? -b_high : (realv)0);
  const realv at_low = norm_slope_v(low, low >= (realv)0 ? far : near, p.mid);
  const realv at_high = norm_slope_v(high, high >= (realv)0 ? near : far, p.mid);
  const realv change = (abs_v(p.rise) + p.error) * WIDEN;
  const realv logarithms = (realv)(sizeof(real) == 4 ? 110 : 750);  // the largest of a ratio of numbers
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
