// memory.cl: packets to and from the arrays of rays.
//
// provides  scatter(), gather(), store_pairs(), store_bytes(), load_bytes()        needs  prelude

// Write lane i to out[i * stride].
static inline void scatter(realv v, global real *out, int stride) {
  real lanes[VW];
  store_lanes(v, lanes);
  for (int i = 0; i < VW; ++i) out[i * stride] = lanes[i];
}

// Write a0, b0, a1, b1, ... from out on, where a packet's pairs begin.
static inline void store_pairs(realv a, realv b, global real *out) {
#if VW == 1
  out[0] = a;
  out[1] = b;
#else
  realv low, high;
  low.even = a.lo;
  low.odd = b.lo;
  high.even = a.hi;
  high.odd = b.hi;
  ((global realv *)out)[0] = low;
  ((global realv *)out)[1] = high;
#endif
}

// Write lane i's small number to out[i], where a packet's begin. Not vstore: on PoCL it goes byte by byte.
static inline void store_bytes(maskv m, global uchar *out) { *(global ubytev *)out = to_bytes(m); }

// Read lane i's small number, of either sign, from in[i], where a packet's begin.
static inline maskv load_bytes(global const char *in) { return from_bytes(*(global const bytev *)in); }

// Read lane i from in[i * stride].
static inline realv gather(global const real *in, int stride) {
  real lanes[VW];
  for (int i = 0; i < VW; ++i) lanes[i] = in[i * stride];
  return load_lanes(lanes);
}
