// paint_floats_srgb.cl: floats that are sRGB-encoded. The curve goes on above 1, its straight part below 0.
//
// provides  light_from(), write_light()        needs  read_float(), write_float()
// source    IEC 61966-2-1:1999, sections 5.2 and 5.3
//
// Constants are quotients of whole numbers, right to the last bit in either precision.

static inline WORK light_from(global const STORED *at, global const float *light_of) {
  const WORK e = read_float(at);
  if (e <= (WORK)4045 / (WORK)100000) return e * (WORK)100 / (WORK)1292;
  return powr((e * (WORK)1000 + (WORK)55) / (WORK)1055, (WORK)12 / (WORK)5);
}

static inline void write_light(WORK light, global const float *srgb_of, global STORED *at) {
  if (light <= (WORK)31308 / (WORK)10000000)
    write_float(light * (WORK)1292 / (WORK)100, at);
  else
    write_float(((WORK)1055 * powr(light, (WORK)5 / (WORK)12) - (WORK)55) / (WORK)1000, at);
}
