// norms.cl: (|a|^p + |b|^p)^(1/p), p >= 1, and its slope.
//
// provides  norm_v(), norm_slope_v()        needs  prelude, functions
//
// With the larger operand m factored out and r <= 1 the ratio of the two, it is m (1 + r^p)^(1/p): no power is of more
// than 2, and nothing overflows. It is smooth where |a| = |b|, though m and r are not.

// r^(p - 1) and (1 + r^p)^(1 / p - 1), of which the value and both slopes are made.
typedef struct {
  realv large, ratio, above;  // above: r^p
  realv of_small, of_both;
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

// The slope by a, sign(a) (|a| / norm)^(p - 1); 0 where a is 0, as it is for p > 1. For p = 1 there is an edge.
static inline realv norm_slope_v(realv a, realv b, realv p) {
  const norm_t n = norm_parts(a, b, p);
  const realv size = (abs_v(a) >= abs_v(b) ? (realv)1 : n.of_small) * n.of_both;
  const realv sum = a + b;
  return sum == sum ? (a > (realv)0 ? size : (a < (realv)0 ? -size : (realv)0)) : sum;
}
