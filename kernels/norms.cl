// norms.cl: (|a|^p + |b|^p)^(1/p), p >= 1, and its slope by a.
//
// provides  norm_v(), norm_slope_v()        needs  prelude, functions
//
// Let m be the larger of |a| and |b|, and r <= 1 the ratio of the smaller to m. The norm is m (1 + r^p)^(1/p). No base of a
// power exceeds 2, so no power overflows. The norm is smooth where |a| = |b|, though m and r are not.

// The value and both slopes are made of these.
typedef struct {
  realv large, ratio, above;  // m, r, r^p
  realv of_small, of_both;    // r^(p - 1), (1 + r^p)^(1 / p - 1)
} norm_t;

static inline norm_t norm_parts(realv a, realv b, realv p) {
  const realv first = abs_v(a), second = abs_v(b);
  norm_t n;
  n.large = max_v(first, second);
  n.ratio = n.large > (realv)0 ? min_v(min_v(first, second) / n.large, (realv)1) : (realv)0;
  n.of_small = pow_v(n.ratio, p - (realv)1);
  n.above = n.ratio * n.of_small;
  n.of_both = pow_v((realv)1 + n.above, (realv)1 / p - (realv)1);
  return n;
}

static inline realv norm_v(realv a, realv b, realv p) {
  const norm_t n = norm_parts(a, b, p);
  const realv sum = a + b;
  return sum == sum ? n.large * (((realv)1 + n.above) * n.of_both) : sum;
}

// The slope by a, sign(a) (|a| / norm)^(p - 1). It is 0 where a is 0. That is exact for p > 1. For p = 1 the norm has an
// edge there.
static inline realv norm_slope_v(realv a, realv b, realv p) {
  const norm_t n = norm_parts(a, b, p);
  const realv size = (abs_v(a) >= abs_v(b) ? (realv)1 : n.of_small) * n.of_both;
  const realv sum = a + b;
  return sum == sum ? (a > (realv)0 ? size : (a < (realv)0 ? -size : (realv)0)) : sum;
}
