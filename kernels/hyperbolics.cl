// hyperbolics.cl: hyperbolic sine and cosine for packets.
//
// provides  sinh_v(), cosh_v()        needs  prelude, functions
//
// A mixed kernel has these words in both precisions, each under its own name.

#undef sinh_v
#undef cosh_v
#define sinh_v PASTE(sinh_of_, REAL)
#define cosh_v PASTE(cosh_of_, REAL)

// exp(a) of a large a overflows before its half does, so it is squared after that. Up to 1 the difference of exponentials
// cancels: there the series is summed, whose first term left out is 2e-20 of the sum.
static inline realv sinh_v(realv a) {
  const realv u = a * a;
  realv sum = (realv)1 + u * (realv)NUMBER(0.002923976608187134503);  // 1 / (18 19)
  sum = (realv)1 + u * sum * (realv)NUMBER(0.003676470588235294118);  // 1 / (16 17)
  sum = (realv)1 + u * sum * (realv)NUMBER(0.004761904761904761905);  // 1 / (14 15)
  sum = (realv)1 + u * sum * (realv)NUMBER(0.006410256410256410256);  // 1 / (12 13)
  sum = (realv)1 + u * sum * (realv)NUMBER(0.009090909090909090909);  // 1 / (10 11)
  sum = (realv)1 + u * sum * (realv)NUMBER(0.01388888888888888889);   // 1 / (8 9)
  sum = (realv)1 + u * sum * (realv)NUMBER(0.02380952380952380952);   // 1 / (6 7)
  sum = (realv)1 + u * sum * (realv)NUMBER(0.05);                     // 1 / (4 5)
  sum = (realv)1 + u * sum * (realv)NUMBER(0.1666666666666666667);    // 1 / (2 3)
  const realv root = exp((realv)NUMBER(0.5) * abs_v(a));
  const realv far = (realv)NUMBER(0.5) * root * root - (realv)NUMBER(0.5) / root / root;
  return abs_v(a) <= (realv)1 ? a * sum : (a < (realv)0 ? -far : far);
}

static inline realv cosh_v(realv a) {
  const realv root = exp((realv)NUMBER(0.5) * abs_v(a));
  return (realv)NUMBER(0.5) * root * root + (realv)NUMBER(0.5) / root / root;
}
