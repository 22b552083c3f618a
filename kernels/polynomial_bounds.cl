// polynomial_bounds.cl: what the coefficients a[0] + a[1] t + ... of f say of f on a stretch of the ray.
//
// provides  SURFACE(bernstein)(), SURFACE(polygon)(), SURFACE(jet)(), SURFACE(recentre)(), SURFACE(curvature)()
// needs     prelude, functions; SURFACE(DEGREE), 3 or more

// The Bernstein coefficients of f on [0, w].
static inline void SURFACE(bernstein)(const realv a[SURFACE(DEGREE) + 1], realv w, realv b[SURFACE(DEGREE) + 1]) {
  realv power = (realv)1;
  real weight = 1;  // 1 / binomial(DEGREE, j)
#pragma unroll
  for (int j = 0; j <= SURFACE(DEGREE); ++j) {
    b[j] = (realv)weight * power * a[j];
    power *= w;
    if (j < SURFACE(DEGREE)) weight *= (real)(j + 1) / (real)(SURFACE(DEGREE) - j);
  }
#pragma unroll
  for (int pass = 1; pass <= SURFACE(DEGREE); ++pass) {
#pragma unroll
    for (int j = SURFACE(DEGREE); j >= pass; --j) b[j] += b[j - 1];
  }
}

// Where the polygon through (i / DEGREE, b[i]) first falls through zero; 1 where it does not.
static inline realv SURFACE(polygon)(const realv b[SURFACE(DEGREE) + 1]) {
  realv above = (realv)0, drop = (realv)1, before = (realv)SURFACE(DEGREE);
#pragma unroll
  for (int i = SURFACE(DEGREE) - 1; i >= 0; --i) {
    const maskv falls = (b[i] > (realv)0) & (b[i + 1] <= (realv)0);
    above = falls ? b[i] : above;
    drop = falls ? b[i] - b[i + 1] : drop;
    before = falls ? (realv)(real)i : before;
  }
  return (before + above / drop) * (realv)((real)1 / SURFACE(DEGREE));
}

// f, f' and f'' / 2 at t.
static inline void SURFACE(jet)(const realv a[SURFACE(DEGREE) + 1], realv t, realv *f, realv *df, realv *half_ddf) {
  *f = a[SURFACE(DEGREE)];
  *df = *half_ddf = (realv)0;
#pragma unroll
  for (int i = SURFACE(DEGREE) - 1; i >= 0; --i) {
    *half_ddf = *half_ddf * t + *df;
    *df = *df * t + *f;
    *f = *f * t + a[i];
  }
}

// Recentre at t: s[k] = f^(k)(t) / k!.
static inline void SURFACE(recentre)(const realv a[SURFACE(DEGREE) + 1], realv t, realv s[SURFACE(DEGREE) + 1]) {
#pragma unroll
  for (int i = 0; i <= SURFACE(DEGREE); ++i) s[i] = a[i];
#pragma unroll
  for (int k = 0; k < SURFACE(DEGREE); ++k) {
#pragma unroll
    for (int i = SURFACE(DEGREE) - 1; i >= k; --i) s[i] += t * s[i + 1];
  }
}

// Bound f'' on the rest of the ray, of length rest in t: its Bernstein coefficients, by sums of its scaled powers.
static inline void SURFACE(curvature)(const realv s[SURFACE(DEGREE) + 1], realv rest, realv *low, realv *high) {
  realv b[SURFACE(DEGREE) - 1];
  realv power = (realv)1;
  real weight = 2;  // (j + 2)(j + 1) / binomial(DEGREE - 2, j)
#pragma unroll
  for (int j = 0; j < SURFACE(DEGREE) - 1; ++j) {
    b[j] = (realv)weight * power * s[j + 2];
    power *= rest;
    if (j < SURFACE(DEGREE) - 2) weight *= (real)(j + 3) / (real)(SURFACE(DEGREE) - 2 - j);
  }
#pragma unroll
  for (int pass = 1; pass < SURFACE(DEGREE) - 1; ++pass) {
#pragma unroll
    for (int j = SURFACE(DEGREE) - 2; j >= pass; --j) b[j] += b[j - 1];
  }
  *low = *high = b[0];
#pragma unroll
  for (int j = 1; j < SURFACE(DEGREE) - 1; ++j) {
    *low = min_v(*low, b[j]);
    *high = max_v(*high, b[j]);
  }
}
