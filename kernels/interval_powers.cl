// interval_powers.cl: quotients, roots and powers of bands.
//
// provides  band_reciprocal(), band_divide(), band_sqrt(), band_cbrt(), band_hypot(), band_pow()
// needs     prelude, functions, interval, interval_arithmetic, interval_curves
//
// least: a lower bound of the operand, proved from its expression. Its band may reach below, by rounding and because it is
// wider than the operand's range.

// 1 / a, for a band of one sign. Let p be the size of its end nearer to zero, and q > p that of the other end. The slope of
// the chord is -1 / (p q). The parallel tangent lies (1 / sqrt(p) - 1 / sqrt(q))^2 lower, and
// (sqrt(p) + sqrt(q))^2 >= 3 p + q.
static inline band_t band_reciprocal(band_t a, realv least) {
  const realv low = max_v(band_low(a), least);
  const realv high = band_high(a);
  const maskv above = low > (realv)0;
  const realv near = above ? low : -high;
  const realv far = above ? high : -low;
  const realv highest = (realv)1 / near;
  const realv slope = highest * ((realv)1 / far);  // near far may overflow; slope may be flushed to zero
  const realv fall = (far - near) * slope;
  band_t c = band_chord(band_pick(above, a, band_negate(a)), near, far, highest, -slope,
                        -fall * (fall / ((far + (realv)3 * near) * slope)), 2 * DIVIDE_ULP + 1);
  c.error = (c.error + UNDERFLOW * (far - near)) * WIDEN;
  return band_known((near > (realv)0) & (far < (realv)REAL_MAX), band_pick(above, c, band_negate(c)));
}

// a / b = q + (a - q b) / b with q = a.mid / b.mid: a - q b is small, so the error of the reciprocal adds little.
static inline band_t band_divide(band_t a, band_t b, realv least) {
  const realv q = a.mid / b.mid;
  const band_t left = band_subtract(a, band_scale(b, q));
  return band_shift(band_multiply(left, band_reciprocal(b, least)), q);
}

// With r and s the roots of the ends, the chord's slope is 1 / (r + s), and the tangent lies (s - r)^2 / (4 (r + s)) higher.
static inline band_t band_sqrt(band_t a, realv least) {
  const realv low = max_v(band_low(a), least);
  const realv high = band_high(a);
  const realv root_low = sqrt(low);
  const realv slope = (realv)1 / (root_low + sqrt(high));
  const realv climb = (high - low) * slope;
  const band_t c = band_chord(a, low, high, root_low, slope, (realv)NUMBER(0.25) * climb * (climb * slope),
                              SQRT_ULP + DIVIDE_ULP + 1);
  return band_known((low >= (realv)0) & (high < (realv)REAL_MAX), c);
}

// Let the band lie on one side of zero, r be the size of the root of its end nearer to zero, and s > r that of the other
// end. The chord's slope is 1 / (r^2 + r s + s^2). The curve has this slope where the root is c, with
// c^2 = (r^2 + r s + s^2) / 3. There the tangent lies slope (c - r)(s - c)(r + c + s) higher, where
// (c - r)(s - c) <= (s - r)^2 / 4 and c <= (r + s) / 2 + (s - r) / 12. A band across zero has the range between the roots.
static inline __attribute__((always_inline)) band_t band_cbrt(band_t a) {
  const realv low = band_low(a);
  const realv high = band_high(a);
  const realv root_low = cbrt_v(low);
  const realv root_high = cbrt_v(high);
  const maskv above = low >= (realv)0;
  const maskv below = high <= (realv)0;
  const realv near = above ? root_low : -root_high;
  const realv far = above ? root_high : -root_low;
  const realv slope = (realv)1 / (near * near + near * far + far * far);
  const realv climb = (high - low) * slope;
  const realv bulge = (realv)NUMBER(0.25) * slope * climb * climb *
                      ((realv)NUMBER(1.5) * (near + far) + (realv)NUMBER(0.083333333333333333) * climb);
  const band_t c = band_chord(band_pick(above, a, band_negate(a)), above ? low : -high, above ? high : -low, near, slope,
                              bulge, 2 * CBRT_ULP + DIVIDE_ULP + 3);
  const band_t range = band_between(root_low, root_high, CBRT_ULP);
  return band_known((low > (realv)-REAL_MAX) & (high < (realv)REAL_MAX),
                    band_pick(above, c, band_pick(below, band_negate(c), range)));
}

static inline band_t band_hypot(band_t a, band_t b) {
  return band_sqrt(band_add(band_square(a), band_square(b)), (realv)0);
}

// a^p, a >= 0: monotonic in a, and so is its second derivative.
static inline band_t band_pow(band_t a, band_t p, realv least) {
  const realv low = max_v(band_low(a), max_v(least, (realv)0));
  const realv high = band_high(a);
  const realv value = pow_v(a.mid, p.mid);
  const realv at_low = pow_v(low, p.mid);
  const realv at_high = pow_v(high, p.mid);

  // A change of p multiplies a^p by a factor between 1 - 2 s and 1 + 2 s, where s = |log a| times that change is <= 1 / 2
  const realv change = (abs_v(p.rise) + p.error) * WIDEN;
  realv s = (realv)0;
  if (any_lane(not_lane(change == (realv)0))) {
    const realv log_low = low > (realv)0 ? log(low) : (realv)0;
    s = change * max_v(abs_v(log(high)), abs_v(log_low)) * LOOSEN;
  }
  const maskv known = (low >= (realv)0) & ((band_low(a) >= (realv)0) | (least >= (realv)0)) &  //
                      (high < (realv)REAL_MAX) & (s <= HALF) & ((low > (realv)0) | (p.mid > change));

  const realv factor = p.mid * (p.mid - (realv)1);
  const realv curve_low = factor * at_low / low / low;
  const realv curve_high = factor * at_high / high / high;
  band_t bent = band_bent(a, value, p.mid * value / a.mid, min_v(curve_low, curve_high), max_v(curve_low, curve_high),
                          POW_ULP + DIVIDE_ULP + 2);
  bent.error = (bent.error + (realv)2 * s * max_v(at_low, at_high) * LOOSEN + (realv)2 * UNDERFLOW) * WIDEN;

  // Near zero the curvature may be unbounded: there take the range between the values at the ends
  const maskv rises = p.mid > (realv)0;
  const realv less = (realv)1 - (realv)2 * s;
  const realv more = ((realv)1 + (realv)2 * s) * WIDEN;
  const band_t range = band_between((rises ? at_low : at_high) * less, (rises ? at_high : at_low) * more, POW_ULP + 4);
  const maskv bends = ((realv)16 * low > high) & (a.mid >= low) &  //
                       (min_v(at_low, at_high) >= (realv)REAL_TINY) & (bent.error <= range.error);
  return band_known(known, band_pick(bends, bent, range));
}
