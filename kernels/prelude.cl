// prelude.cl: the vocabulary every other fragment is written in.
//
// provides  real, realv, maskv, bitsv, real3v, LANES; as_bits(), as_numbers(), to_bits(), to_numbers(); any_lane(),
//           not_lane(); dot3(), unit3(), at3(), pick3(), broadcast3()
// set by    the generated head: REAL float|double, MASK int|long, VW 1|2|4|8|16, REAL_MAX, REAL_TINY,
//           REAL_EPSILON, NUMBER(x), a literal in that precision (0.6f left in a double build would cost 3e-8)
//
// A packet is VW rays held in the lanes of vectors; one work-item carries one packet. This file alone knows how wide a
// packet is and how precise a number is. Comparisons give masks: 0 or -1 in a vector's lanes, 0 or 1 for one lane, so a
// mask is only chosen by (m ? a : b), joined by & and |, and turned by not_lane().

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
#define from_bytes(b) ((maskv)(b))
#define as_bits(v) PASTE(as_, MASK)(v)
#define as_numbers(b) PASTE(as_, REAL)(b)
#define to_bits(v) PASTE(convert_, MASK)(v)
#define to_numbers(b) PASTE(convert_, REAL)(b)
typedef MASK bitsv;
#else
typedef PASTE(REAL, VW) realv;
typedef PASTE(MASK, VW) maskv;
typedef PASTE(uchar, VW) ubytev;
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
#if VW == 16
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

typedef struct {
  realv x, y, z;
} real3v;  // a structure of lanes, never float3

static inline realv dot3(real3v a, real3v b) { return a.x * b.x + a.y * b.y + a.z * b.z; }

// One division for three: unit to 2 ulp.
static inline real3v unit3(real3v a) {
  const realv scale = (realv)1 / sqrt(dot3(a, a));
  const real3v v = {a.x * scale, a.y * scale, a.z * scale};
  return v;
}

// The point o + t d.
static inline real3v at3(real3v o, real3v d, realv t) {
  const real3v p = {o.x + t * d.x, o.y + t * d.y, o.z + t * d.z};
  return p;
}

static inline real3v pick3(maskv m, real3v a, real3v b) {
  const real3v v = {m ? a.x : b.x, m ? a.y : b.y, m ? a.z : b.z};
  return v;
}

static inline real3v broadcast3(const real *a) {
  const real3v v = {(realv)a[0], (realv)a[1], (realv)a[2]};
  return v;
}
