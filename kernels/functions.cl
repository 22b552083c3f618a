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

// The power of two that brings |a| into [1, 2), read from its exponent. For 0 it is the largest power there is; for
// infinity and NaN, none.
static inline realv down_scale(realv a) {
  const bitsv exponents = as_bits((realv)INFINITY);
  return as_numbers(exponents - as_bits((realv)REAL_TINY) - (as_bits(a) & exponents));
}

// The built-in power; PoCL 3.0's of a double8 with a lane of 0, 1e-300, infinity or NaN is wrong in other lanes, that of a
// double4 is not.
static inline realv pow_built_in(realv a, realv b) {
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

#define IS_FINE (REAL_EPSILON < NUMBER(1e-10))
#define LOG_2_HIGH (IS_FINE ? NUMBER(0.693147180369123816490) : NUMBER(0.69313812256))  // times 2^10 still exact
#define LOG_2_LOW (IS_FINE ? NUMBER(1.90821492927058770002e-10) : NUMBER(9.0580006145e-06))
#define UPPER_HALF (IS_FINE ? (real)134217729 : (real)4097)  // splits a number into halves

// a^b for a >= 0, else NaN; to 2 ulp for |b| <= 64 and normal results: exp(b log a), the logarithm and the product in two
// parts each. With a = 2^e m and f = (m - 1) / (m + 1), log m = 2 f + 2 f^3 / 3 + 2 f^5 / 5 + ..., |f| < 0.172: all but
// the first term is less than a hundredth. The built-in goes lane by lane on PoCL; it does the rest.
//
// source    Dekker, A floating-point technique for extending the available precision, Numer. Math. 18, 1971, for the exact
//           product; Muller, Elementary Functions, 3rd ed., sec. 11, for the rest
static inline realv pow_v(realv a, realv b) {
#pragma OPENCL FP_CONTRACT OFF
  const realv one = (realv)1, unit = to_numbers(as_bits((realv)REAL_TINY));  // one step of the exponent
  const realv bias = to_numbers(as_bits(one)) / unit;
  const maskv wide = a * down_scale(a) > (realv)NUMBER(1.41421356);
  const realv m = a * down_scale(a) * (wide ? (realv)NUMBER(0.5) : one);
  const realv e = to_numbers(as_bits(a) & as_bits((realv)INFINITY)) / unit - bias + (wide ? one : (realv)0);

  // f in two parts: what the quotient leaves, exactly
  const realv above = m - one, sum = m + one, lost = m - (sum - one);
  const realv f = above / sum;
  const realv f_big = f * UPPER_HALF, f_up = f_big - (f_big - f), f_down = f - f_up;
  const realv s_big = sum * UPPER_HALF, s_up = s_big - (s_big - sum), s_down = sum - s_up;
  const realv product = f * sum;
  const realv product_low = ((f_up * s_up - product) + f_up * s_down + f_down * s_up) + f_down * s_down;
  const realv f_low = (((above - product) - product_low) - f * lost) / sum;
  const realv square = f * f;
  realv tail = (realv)0;
#pragma unroll
  for (int k = IS_FINE ? 12 : 5; k > 0; --k) tail = (tail + (realv)((real)2 / (real)(2 * k + 1))) * square;

  // log a = high + low, then times b
  const realv steps = e * LOG_2_HIGH, twice = f + f;
  const realv high = steps + twice, seen = high - steps;
  const realv low = ((steps - (high - seen)) + (twice - seen)) + ((f_low + f_low) + f * tail + e * LOG_2_LOW);
  const realv h_big = high * UPPER_HALF, h_up = h_big - (h_big - high), h_down = high - h_up;
  const realv b_big = b * UPPER_HALF, b_up = b_big - (b_big - b), b_down = b - b_up;
  const realv power = b * high;
  const realv power_low = (((h_up * b_up - power) + h_up * b_down + h_down * b_up) + h_down * b_down) + b * low;

  // exp: 2^n times the exponential of what is left
  const realv n = floor((power + power_low) * (realv)NUMBER(1.44269504088896341) + (realv)NUMBER(0.5));
  const realv r = (power - n * LOG_2_HIGH) - (n * LOG_2_LOW - power_low);
  realv grown = one;
#pragma unroll
  for (int k = IS_FINE ? 13 : 7; k > 0; --k) grown = one + r * (realv)((real)1 / (real)k) * grown;
  const realv scale = as_numbers(to_bits((n + bias) * unit));

  // From half the largest number on, down_scale(a) is less than any normal number
  const maskv usual = (a >= (realv)REAL_TINY) & (a <= (realv)(REAL_MAX * NUMBER(0.5))) & (abs_v(b) <= (realv)64) &
                      (abs_v(power) < (realv)(IS_FINE ? 700 : 86));
  const maskv zero = (a == (realv)0) & (b > (realv)0) & (b <= (realv)64);
  const realv found = zero ? (realv)0 : grown * scale;
  const maskv others = (a >= (realv)0) & not_lane(usual | zero);
  const realv all = any_lane(others) ? pow_built_in(a, b) : found;
  return (usual | zero) ? found : (others ? all : (realv)NAN);
}
