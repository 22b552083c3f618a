// interval_hyperbolics.cl: hyperbolic sine and cosine of bands.
//
// provides  band_sinh(), band_cosh()        needs  prelude, functions, hyperbolics, interval, interval_curves

#define HYPERBOLIC_ULP 16  // two exponentials of 3 each, halves and quotients, and what cancels beyond 1

// sinh'' = sinh increases. On a long segment the range between the values at the ends is the narrower band.
static inline band_t band_sinh(band_t a) {
  const realv low = sinh_v(band_low(a));
  const realv high = sinh_v(band_high(a));
  const band_t bent = band_bent(a, sinh_v(a.mid), cosh_v(a.mid), low, high, HYPERBOLIC_ULP);
  const band_t range = band_between(low, high, HYPERBOLIC_ULP);
  return band_known(high - low < (realv)REAL_MAX, band_pick(bent.error <= range.error, bent, range));
}

// cosh'' = cosh is largest at the end farther from zero, and least where |a| is.
static inline band_t band_cosh(band_t a) {
  const realv low = band_low(a);
  const realv high = band_high(a);
  const realv near = low > (realv)0 ? low : (high < (realv)0 ? -high : (realv)0);
  const realv least = cosh_v(near);
  const realv most = cosh_v(max_v(abs_v(low), abs_v(high)));
  const band_t bent = band_bent(a, cosh_v(a.mid), sinh_v(a.mid), least, most, HYPERBOLIC_ULP);
  const band_t range = band_between(least, most, HYPERBOLIC_ULP);
  const maskv known = (high - low < (realv)REAL_MAX) & (most < (realv)REAL_MAX);
  return band_known(known, band_pick(bent.error <= range.error, bent, range));
}
