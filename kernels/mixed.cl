// mixed.cl: between a ray in double and its search in single.
//
// provides  to_single(), to_double(), single_vector(), single_lanes(), double_lanes()
// needs     prelude in both precisions

#if VW == 1
#define to_single(v) ((float)(v))
#define to_double(v) ((double)(v))
#define single_lanes(m) (m)
#define double_lanes(m) (m)
#else
#define to_single(v) PASTE(convert_float, VW)(v)
#define to_double(v) PASTE(convert_double, VW)(v)
#define single_lanes(m) PASTE(convert_int, VW)(m)
#define double_lanes(m) PASTE(convert_long, VW)(m)
#endif

static inline single_real3v single_vector(real3v a) {
  const single_real3v v = {to_single(a.x), to_single(a.y), to_single(a.z)};
  return v;
}
