// prelude.cl: the vocabulary every other fragment is written in: numbers and vectors of three.
//
// provides  real3v; dot3(), cross3(), unit3(), at3(), pick3(), broadcast3()        needs  lanes
// set by    the generated head: REAL_MAX, REAL_TINY, REAL_EPSILON, NUMBER(x), a literal in the kernel's precision (0.6f
//           left in a double build would cost 3e-8)

typedef struct {
  realv x, y, z;
} real3v;  // a structure of lanes, never float3

static inline realv dot3(real3v a, real3v b) { return a.x * b.x + a.y * b.y + a.z * b.z; }

static inline real3v cross3(real3v a, real3v b) {
  const real3v v = {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
  return v;
}

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
