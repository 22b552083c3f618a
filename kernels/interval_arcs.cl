// interval_arcs.cl: arc sine, cosine and tangent of bands.
//
// provides  band_asin(), band_acos(), band_atan()        needs  prelude, functions, arcs, interval, interval_curves
//
// within: 1 if the operand is proved from its expression to lie between -1 and 1. Its band may reach beyond, by rounding
// and because it is wider than the operand's range. Else a band that reaches beyond is that of an operand that may have no
// arc sine: it is unknown.

#define ARC_ULP 12  // 6 for atan2, 4 for the root in single and its operand, and room

// asin'' = a (1 - a^2)^(-3/2) increases. It goes to infinity at the ends of the domain: there the range between the values
// at the ends is the narrower band.
static inline band_t band_asin(band_t a, int within) {
  const realv own_low = band_low(a), own_high = band_high(a);
  const realv low = within ? min_v(max_v(own_low, (realv)-1), (realv)1) : own_low;
  const realv high = within ? max_v(min_v(own_high, (realv)1), (realv)-1) : own_high;
  const realv rest = ((realv)1 - a.mid) * ((realv)1 + a.mid);
  const realv rest_low = ((realv)1 - low) * ((realv)1 + low), rest_high = ((realv)1 - high) * ((realv)1 + high);
  const band_t bent = band_bent(a, asin_v(a.mid), (realv)1 / sqrt(rest), low / (rest_low * sqrt(rest_low)),
                                high / (rest_high * sqrt(rest_high)), ARC_ULP);
  const band_t range = band_between(asin_v(low), asin_v(high), ARC_ULP);
  const maskv bends = (rest_low > (realv)0) & (rest_high > (realv)0) & (bent.error <= range.error);
  const maskv known = (own_high - own_low < (realv)REAL_MAX) & (low >= (realv)-1) & (low <= (realv)1) &  //
                      (high >= (realv)-1) & (high <= (realv)1);
  return band_known(known, band_pick(bends, bent, range));
}

// pi / 2 - asin(a)
static inline band_t band_acos(band_t a, int within) {
  const band_t b = band_shift(band_negate(band_asin(a, within)), (realv)NUMBER(1.5707963267948966));
  const band_t c = {b.mid, b.rise, (b.error + (realv)2 * ROUNDING) * WIDEN};
  return c;
}

// atan'' = -2 a / (1 + a^2)^2 is at most 0.65 in size, and at most 2 / |a|^3. It has the other sign than a.
static inline band_t band_atan(band_t a) {
  const realv low = band_low(a);
  const realv high = band_high(a);
  const realv near = low > (realv)0 ? low : (high < (realv)0 ? -high : (realv)0);
  const realv most = min_v((realv)NUMBER(0.65), (realv)2 / near / near / near * LOOSEN);
  const band_t bent = band_bent(a, atan_v(a.mid), (realv)1 / ((realv)1 + a.mid * a.mid),
                                high > (realv)0 ? -most : (realv)0, low < (realv)0 ? most : (realv)0, ARC_ULP);
  const band_t range = band_between(atan_v(low), atan_v(high), ARC_ULP);
  return band_known(high - low < (realv)REAL_MAX, band_pick(bent.error <= range.error, bent, range));
}
