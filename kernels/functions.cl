// functions.cl: functions of numbers that the built-ins do slowly, or wrongly, for packets.
//
// provides  abs_v(), min_v(), max_v(), pow_v(), cbrt_v(), cbrt_normal_v(), down_scale()        needs  prelude

// The built-ins fabs, fmin and fmax are calls on PoCL; these are one instruction. min_v and max_v do not pass on a NaN in b.
static inline realv abs_v(realv a) { return as_numbers(as_bits(a) & ~as_bits((realv)-0.0f)); }
static inline realv min_v(realv a, realv b) { return b < a ? b : a; }
static inline realv max_v(realv a, realv b) { return b > a ? b : a; }

// The cube root of a positive normal number to 2 ulp, without a division, and 1 over it to 4. The built-in goes lane by
// lane on PoCL. With r near x^(-1/3), read from the bits of x to 3.5 %, and h = 1 - x r^3, the next r is
// r (1 - h)^(-1/3) = r (1 + h / 3 + 2 h^2 / 9 + ...): from 3.5 % two turns lead to 1e-9, and one of Newton's, on the root
// itself or then on 1 over it, to the last bits.
static inline realv cbrt_normal_v(realv x, realv *inverse) {
  const realv third = (realv)NUMBER(0.33333333333333333), two_ninths = (realv)NUMBER(0.22222222222222222);
  const realv seed = (realv)4 * third * to_numbers(as_bits((realv)1)) -
                     (realv)NUMBER(0.06615) * to_numbers(as_bits((realv)REAL_TINY));
  realv r = as_numbers(to_bits(seed - third * to_numbers(as_bits(x))));
  for (int turn = 0; turn < 2; ++turn) {
    const realv h = (realv)1 - x * r * (r * r);
    r = r + r * h * (third + two_ninths * h);
  }
  const realv y = x * (r * r);
  const realv root = y - (y * y * y - x) * (third * (r * r));
  *inverse = r + r * ((realv)1 - r * root);
  return root;
}

// The same of all numbers; zeros, infinities and NaN are kept. The root of zero is zero times what is finite.
static inline realv cbrt_v(realv a) {
  const realv size = abs_v(a);
  const maskv small = size < (realv)REAL_TINY;  // subnormal: its bits are no logarithm
  realv unused;
  const realv root = cbrt_normal_v(small ? size * (realv)NUMBER(18014398509481984.0) : size, &unused);  // 2^54
  const realv scaled = small ? root * (realv)NUMBER(3.814697265625e-06) : root;  // 2^-18
  const bitsv sign = as_bits(a) & as_bits((realv)-0.0f);
  return size > (realv)REAL_MAX ? a : as_numbers(as_bits(scaled) | sign);
}

// PoCL 3.0's pow of a double8 with a lane of 0, 1e-300, infinity or NaN is wrong in other lanes; that of a double4 is not.
static inline realv pow_v(realv a, realv b) {
#if VW <= 4
  return pow(a, b);
#else
  real base[VW], exponent[VW];
  store_lanes(a, base);
  store_lanes(b, exponent);
  for (int i = 0; i < VW; i += 4) vstore4(pow(vload4(0, base + i), vload4(0, exponent + i)), 0, base + i);
  return load_lanes(base);
#endif
}

// The power of two that brings |a| into [1, 2), read from its exponent. For 0 it is the largest power there is; for
// infinity and NaN, none.
static inline realv down_scale(realv a) {
  const bitsv exponents = as_bits((realv)INFINITY);
  return as_numbers(exponents - as_bits((realv)REAL_TINY) - (as_bits(a) & exponents));
}
