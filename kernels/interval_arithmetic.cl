// interval_arithmetic.cl: sums, products and choices of bands.
//
// provides  band_exact(), band_rounded(), band_add(), band_negate(), band_subtract(), band_shift(), band_scale(),
//           band_multiply(), band_times_flat(), band_square(); band_abs(), band_min(), band_max(), band_where()
// needs     prelude, interval

// A number as it was given; where inputs are rounded to this precision (INPUT_ROUNDINGS), so was it.
static inline band_t band_exact(realv a) {
  const band_t c = {a, (realv)0, (realv)INPUT_ROUNDINGS * ROUNDING * abs_v(a)};
  return c;
}

// A number that has been rounded to this precision.
static inline band_t band_rounded(realv a) {
  const band_t c = {a, (realv)0, ROUNDING * abs_v(a)};
  return c;
}

static inline band_t band_add(band_t a, band_t b) {
  const realv mid = a.mid + b.mid;
  const realv rise = a.rise + b.rise;
  const band_t c = {mid, rise, (a.error + b.error + (ROUNDING * (abs_v(mid) + abs_v(rise)) + UNDERFLOW)) * WIDEN};
  return c;
}

static inline band_t band_negate(band_t a) {
  const band_t c = {-a.mid, -a.rise, a.error};
  return c;
}

static inline band_t band_subtract(band_t a, band_t b) { return band_add(a, band_negate(b)); }

// Add a number as it was given.
static inline band_t band_shift(band_t a, realv s) {
  const realv mid = a.mid + s;
  const realv given = (realv)INPUT_ROUNDINGS * ROUNDING * abs_v(s);
  const band_t c = {mid, a.rise, (a.error + given + (ROUNDING * abs_v(mid) + UNDERFLOW)) * WIDEN};
  return c;
}

// Multiply by a number as it was given.
static inline band_t band_scale(band_t a, realv s) {
  const realv mid = a.mid * s;
  const realv rise = a.rise * s;
  const band_t c = {mid, rise,
                    (a.error * abs_v(s) +
                     ((realv)(1 + INPUT_ROUNDINGS) * ROUNDING * (abs_v(mid) + abs_v(rise)) + UNDERFLOW)) *
                        WIDEN};
  return c;
}

// (a + a' u)(b + b' u): u^2 is in [0, 1], so a' b' u^2 is a' b' / 2 but for half of itself. The line's four products
// and two sums are wrong by at most two roundings of the sizes' product.
static inline band_t band_multiply(band_t a, band_t b) {
  const realv bend = HALF * a.rise * b.rise;
  const realv size_a = abs_v(a.mid) + abs_v(a.rise);
  const realv size_b = abs_v(b.mid) + abs_v(b.rise) + b.error;
  const band_t c = {
      a.mid * b.mid + bend, a.mid * b.rise + a.rise * b.mid,
      (abs_v(bend) + size_a * (b.error + (realv)2 * ROUNDING * size_b) + (a.error * size_b + UNDERFLOW)) * WIDEN};
  return c;
}

// Multiply by a band without rise.
static inline band_t band_times_flat(band_t a, band_t b) {
  const realv size_a = abs_v(a.mid) + abs_v(a.rise);
  const realv size_b = abs_v(b.mid);
  const band_t c = {
      a.mid * b.mid, a.rise * b.mid,
      (size_a * (b.error + ROUNDING * size_b) + (a.error * (size_b + b.error) + UNDERFLOW)) * WIDEN};
  return c;
}

static inline band_t band_square(band_t a) {
  const realv bend = HALF * a.rise * a.rise;
  const realv size = abs_v(a.mid) + abs_v(a.rise);
  const band_t c = {a.mid * a.mid + bend, (realv)2 * a.mid * a.rise,
                    (bend + (realv)2 * ROUNDING * size * size + (a.error * ((realv)2 * size + a.error) + UNDERFLOW)) *
                        WIDEN};
  return c;
}

// |a|. Across zero it lies between k a and k a + room, k the slope of the chord from low to high.
static inline band_t band_abs(band_t a) {
  const realv low = band_low(a);
  const realv high = band_high(a);
  const realv k = (low + high) / (high - low);
  const realv slope = k > (realv)1 ? (realv)1 : (k < (realv)-1 ? (realv)-1 : k);
  const realv room = max_v(high * ((realv)1 - slope), -low * ((realv)1 + slope)) * LOOSEN;
  const band_t chord = {slope * a.mid + HALF * room, slope * a.rise,
                        (abs_v(slope) * a.error + HALF * room +
                         (realv)2 * ROUNDING * (abs_v(a.mid) + abs_v(a.rise) + room) + UNDERFLOW) *
                            WIDEN};
  return band_pick(low >= (realv)0, a, band_pick(high <= (realv)0, band_negate(a), chord));
}

// min(a, b) = (a + b - |a - b|) / 2, and max likewise, where both can be the one; the one itself where it is sure.
static inline band_t band_min(band_t a, band_t b) {
  const band_t apart = band_subtract(a, b);
  const band_t both = band_scale(band_subtract(band_add(a, b), band_abs(apart)), HALF);
  return band_pick(band_high(apart) <= (realv)0, a, band_pick(band_low(apart) >= (realv)0, b, both));
}

static inline band_t band_max(band_t a, band_t b) { return band_negate(band_min(band_negate(a), band_negate(b))); }

// a < b ? first : second
static inline band_t band_where(band_t a, band_t b, band_t first, band_t second) {
  const band_t apart = band_subtract(a, b);
  const realv mid = HALF * first.mid + HALF * second.mid;
  const realv rise = HALF * first.rise + HALF * second.rise;
  const band_t both = {
      mid, rise,
      (max_v(first.error, second.error) + (realv)0 * (first.error + second.error) +  // NaN, where one is unknown
       HALF * (abs_v(first.mid - second.mid) + abs_v(first.rise - second.rise)) +
       (realv)2 * ROUNDING * (abs_v(first.mid) + abs_v(second.mid) + abs_v(first.rise) + abs_v(second.rise)) +
       UNDERFLOW) *
          WIDEN};
  return band_pick(band_high(apart) < (realv)0, first, band_pick(band_low(apart) >= (realv)0, second, both));
}
