// lanes.cl: how wide a packet is and how precise a number is; no other file knows.
//
// provides  real, realv, maskv, bitsv, ubytev, bytev, LANES; as_bits(), as_numbers(), to_bits(), to_numbers(), to_bytes(),
//           from_bytes(), store_lanes(), load_lanes(); any_lane(), not_lane(), count_lanes()
// set by    the generated head: REAL float|double, MASK int|long, VW 1|2|4|8|16|32
//
// A packet is VW rays held in the lanes of vectors; one work-item carries one packet. Comparisons give masks: 0 or -1 in
// a vector's lanes, 0 or 1 for one lane, so a mask is only chosen by (m ? a : b), joined by & and |, and turned by
// not_lane().

#define PASTE_(a, b) a##b
#define PASTE(a, b) PASTE_(a, b)

typedef REAL real;

#if VW == 1
typedef REAL realv;
typedef int maskv;
#define LANES ((realv)0)
#define store_lanes(v, at) (*(at) = (v))
#define load_lanes(at) (*(at))
#define to_bytes(m) ((uchar)(m))
typedef uchar ubytev;
typedef char bytev;
#define from_bytes(b) ((maskv)(b))
#define as_bits(v) PASTE(as_, MASK)(v)
#define as_numbers(b) PASTE(as_, REAL)(b)
#define to_bits(v) PASTE(convert_, MASK)(v)
#define to_numbers(b) PASTE(convert_, REAL)(b)
typedef MASK bitsv;
#elif VW == 32
// Wider than OpenCL's own vectors: two for each register, so that one's waits are filled by the other. Clang's vectors
// know all operators; the built-in functions are called for each half
typedef REAL realv __attribute__((ext_vector_type(VW)));
typedef MASK bitsv __attribute__((ext_vector_type(VW)));
typedef bitsv maskv;
typedef uchar ubytev __attribute__((ext_vector_type(VW)));
typedef char bytev __attribute__((ext_vector_type(VW)));
#define LANES                                                                                                       \
  ((realv)(0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15, 16, 17, 18, 19, 20, 21, 22, 23, 24, 25, 26, 27, 28, \
           29, 30, 31))
typedef realv anywhere_realv __attribute__((aligned(4)));
#define store_lanes(v, at) (*(anywhere_realv *)(at) = (v))
#define load_lanes(at) (*(const anywhere_realv *)(at))
#define to_bytes(m) __builtin_convertvector(m, ubytev)
#define from_bytes(b) __builtin_convertvector(b, maskv)
#define as_bits(v) __builtin_astype(v, bitsv)
#define as_numbers(b) __builtin_astype(b, realv)
#define to_bits(v) __builtin_convertvector(v, bitsv)
#define to_numbers(b) __builtin_convertvector(b, realv)
#define OF_HALVES(name, parameters, low, high)                       \
  static inline realv __attribute__((overloadable)) name parameters { \
    realv v;                                                         \
    v.lo = name low;                                                 \
    v.hi = name high;                                                \
    return v;                                                        \
  }
#define OF_ONE(name) OF_HALVES(name, (realv a), (a.lo), (a.hi))
#define OF_TWO(name) OF_HALVES(name, (realv a, realv b), (a.lo, b.lo), (a.hi, b.hi))
OF_ONE(sqrt) OF_ONE(floor) OF_ONE(exp) OF_ONE(log) OF_ONE(sin) OF_ONE(cos) OF_ONE(tan) OF_ONE(tanh) OF_ONE(atan)
OF_TWO(atan2) OF_TWO(hypot)
OF_HALVES(fma, (realv a, realv b, realv c), (a.lo, b.lo, c.lo), (a.hi, b.hi, c.hi))
#else
typedef PASTE(REAL, VW) realv;
typedef PASTE(MASK, VW) maskv;
typedef PASTE(uchar, VW) ubytev;
typedef PASTE(char, VW) bytev;
#define as_bits(v) PASTE(PASTE(as_, MASK), VW)(v)
#define as_numbers(b) PASTE(PASTE(as_, REAL), VW)(b)
#define to_bits(v) PASTE(PASTE(convert_, MASK), VW)(v)
#define to_numbers(b) PASTE(PASTE(convert_, REAL), VW)(b)
typedef PASTE(MASK, VW) bitsv;
#define store_lanes(v, at) PASTE(vstore, VW)(v, 0, at)
#define load_lanes(at) PASTE(vload, VW)(0, at)
#define to_bytes(m) PASTE(convert_uchar, VW)(m)
#define from_bytes(b) PASTE(PASTE(convert_, MASK), VW)(b)
#if VW == 2
#define LANES ((realv)(0, 1))
#elif VW == 4
#define LANES ((realv)(0, 1, 2, 3))
#elif VW == 8
#define LANES ((realv)(0, 1, 2, 3, 4, 5, 6, 7))
#else
#define LANES ((realv)(0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15))
#endif
#endif

// Whether any lane of a mask is set. Not the built-in any(): it is a call on PoCL, and for one lane it tests the top bit.
static inline int any_lane(maskv m) {
#if VW == 32
  const PASTE(MASK, 16) by_16 = m.lo | m.hi;
  const PASTE(MASK, 8) by_8 = by_16.lo | by_16.hi;
  const PASTE(MASK, 4) by_4 = by_8.lo | by_8.hi;
#elif VW == 16
  const PASTE(MASK, 8) by_8 = m.lo | m.hi;
  const PASTE(MASK, 4) by_4 = by_8.lo | by_8.hi;
#elif VW == 8
  const PASTE(MASK, 4) by_4 = m.lo | m.hi;
#elif VW == 4
  const maskv by_4 = m;
#endif
#if VW == 1
  return m != 0;
#elif VW == 2
  return (m.x | m.y) != 0;
#else
  const PASTE(MASK, 2) by_2 = by_4.lo | by_4.hi;
  return (by_2.x | by_2.y) != 0;
#endif
}

static inline maskv not_lane(maskv m) { return m == (maskv)0; }

// How many lanes of a mask are set.
static inline int count_lanes(maskv m) {
#if VW == 1
  return m != 0;
#else
  const ubytev ones = to_bytes(m & (maskv)1);
  int count = 0;
  for (int lane = 0; lane < VW; ++lane) count += ((const uchar *)&ones)[lane];
  return count;
#endif
}
