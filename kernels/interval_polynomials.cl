// interval_polynomials.cl: polynomials of low degree on a segment of a ray, as bands.
//
// provides  linear_t, quadratic_t, cubic_t, quartic_t; band_of_*(), start_of_*(), slope_of_*() of each; parabola_root()
// needs     prelude, interval
//
// The largest polynomial parts of F are written as c[0] + c[1] u + ..., u from -1 to 1 on the segment, wrong by at most
// `error`. The terms above the line have narrow bounds:
//
//   u^2 lies in [0, 1],   u^3 within 1/4 of 3/4 u,   u^4 in [0, 1].

typedef struct {
  realv c[2], error;
} linear_t;
typedef struct {
  realv c[3], error;
} quadratic_t;
typedef struct {
  realv c[4], error;
} cubic_t;
typedef struct {
  realv c[5], error;
} quartic_t;

// The polynomial on all of the segment.
static inline band_t band_of_linear(linear_t q) {
  const band_t band = {q.c[0], q.c[1], q.error};
  return band;
}

static inline band_t band_of_quadratic(quadratic_t q) {
  const realv bent = HALF * q.c[2];
  const band_t band = {q.c[0] + bent, q.c[1], (abs_v(bent) + q.error) * WIDEN};
  return band;
}

static inline band_t band_of_cubic(cubic_t q) {
  const realv bent = HALF * q.c[2];
  const realv twisted = (realv)NUMBER(0.25) * q.c[3];
  const band_t band = {q.c[0] + bent, q.c[1] + (realv)3 * twisted, (abs_v(bent) + abs_v(twisted) + q.error) * WIDEN};
  return band;
}

static inline band_t band_of_quartic(quartic_t q) {
  const realv bent = HALF * q.c[2];
  const realv twisted = (realv)NUMBER(0.25) * q.c[3];
  const realv curled = HALF * q.c[4];
  const band_t band = {q.c[0] + bent + curled, q.c[1] + (realv)3 * twisted,
                       (abs_v(bent) + abs_v(twisted) + abs_v(curled) + q.error) * WIDEN};
  return band;
}

// The polynomial's value at the segment's start, u = -1.
static inline band_t start_of_linear(linear_t q) {
  const band_t band = {q.c[0] - q.c[1], (realv)0, q.error};
  return band;
}

static inline band_t start_of_quadratic(quadratic_t q) {
  const band_t band = {q.c[0] - q.c[1] + q.c[2], (realv)0, q.error};
  return band;
}

static inline band_t start_of_cubic(cubic_t q) {
  const band_t band = {q.c[0] - q.c[1] + (q.c[2] - q.c[3]), (realv)0, q.error};
  return band;
}

static inline band_t start_of_quartic(quartic_t q) {
  const band_t band = {q.c[0] - q.c[1] + (q.c[2] - q.c[3]) + q.c[4], (realv)0, q.error};
  return band;
}

// The polynomial's slope by u. The error of the coefficient of u^n enters n times.
static inline band_t slope_of_linear(linear_t q) {
  const band_t band = {q.c[1], (realv)0, q.error};
  return band;
}

static inline band_t slope_of_quadratic(quadratic_t q) {
  const band_t band = {q.c[1], (realv)2 * q.c[2], (realv)2 * q.error};
  return band;
}

static inline band_t slope_of_cubic(cubic_t q) {
  const quadratic_t slope = {{q.c[1], (realv)2 * q.c[2], (realv)3 * q.c[3]}, (realv)3 * q.error};
  return band_of_quadratic(slope);
}

static inline band_t slope_of_quartic(quartic_t q) {
  const cubic_t slope = {{q.c[1], (realv)2 * q.c[2], (realv)3 * q.c[3], (realv)4 * q.c[4]}, (realv)4 * q.error};
  return band_of_cubic(slope);
}

// A lower (early) or upper bound of the first root of level - falls t - bends t^2 / 2, level >= 0. If there is no root, the
// result is negative, infinite or NaN. The largest of the three numbers is about 1, so squares do not overflow. Squares that
// underflow do not matter for roots up to 2.
static inline realv parabola_root(realv level, realv falls, realv bends, bool early) {
  const realv square = falls * falls;
  const realv product = (realv)2 * level * bends;
  const realv room = (realv)(8 * REAL_EPSILON) * (square + abs_v(product));
  const maskv down = falls > (realv)0;
  const realv reach = sqrt(square + product + ((early ? down : not_lane(down)) ? room : -room));
  return (down ? level + level : reach - falls) / (down ? falls + reach : bends);
}
