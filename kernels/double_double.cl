// double_double.cl: numbers of twice the precision, each the unevaluated sum of two.
//
// provides  dd_t, dd3_t; dd_of(), dd_sum(), dd_product(), dd_add(), dd_subtract(), dd_negate(), dd_multiply(), dd_divide(),
//           dd_round()
// needs     lanes, in double precision
// source    Joldes, Muller, Popescu, Tight and rigorous error bounds for basic building blocks of double-word arithmetic,
//           ACM Transactions on Mathematical Software 44(2), 2017, algorithms 1-3, 6, 12 and 17: with u = 2^-53 the
//           relative errors of add, multiply and divide are at most 3.1 u^2, 5 u^2 and 15 u^2
//
// The exact sum of a and b must not be contracted with a product that b holds.
#pragma OPENCL FP_CONTRACT OFF

typedef struct {
  realv high, low;  // |low| is at most half an ulp of high
} dd_t;

typedef struct {
  dd_t x, y, z;
} dd3_t;

static inline dd_t dd_of(realv a) {
  const dd_t c = {a, (realv)0};
  return c;
}

static inline realv dd_round(dd_t a) { return a.high; }

// a + b exactly, |a| >= |b| or a = 0.
static inline dd_t dd_ordered_sum(realv a, realv b) {
  const realv s = a + b;
  const dd_t c = {s, b - (s - a)};
  return c;
}

// a + b exactly.
static inline dd_t dd_sum(realv a, realv b) {
  const realv s = a + b;
  const realv b_seen = s - a;
  const dd_t c = {s, (a - (s - b_seen)) + (b - b_seen)};
  return c;
}

// a b exactly, short of underflow.
static inline dd_t dd_product(realv a, realv b) {
  const realv p = a * b;
  const dd_t c = {p, fma(a, b, -p)};
  return c;
}

static inline dd_t dd_negate(dd_t a) {
  const dd_t c = {-a.high, -a.low};
  return c;
}

static inline dd_t dd_add(dd_t a, dd_t b) {
  const dd_t s = dd_sum(a.high, b.high);
  const dd_t t = dd_sum(a.low, b.low);
  const dd_t v = dd_ordered_sum(s.high, s.low + t.high);
  return dd_ordered_sum(v.high, t.low + v.low);
}

static inline dd_t dd_subtract(dd_t a, dd_t b) { return dd_add(a, dd_negate(b)); }

static inline dd_t dd_multiply(dd_t a, dd_t b) {
  const dd_t p = dd_product(a.high, b.high);
  const realv crossed = fma(a.low, b.high, fma(a.high, b.low, a.low * b.low));
  return dd_ordered_sum(p.high, p.low + crossed);
}

static inline dd_t dd_divide(dd_t a, dd_t b) {
  const realv quotient = a.high / b.high;
  const dd_t p = dd_multiply(b, dd_of(quotient));
  const realv left = (a.high - p.high) + (a.low - p.low);
  return dd_ordered_sum(quotient, left / b.high);
}

#pragma OPENCL FP_CONTRACT ON
