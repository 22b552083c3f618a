// paint_codes_srgb.cl: integers that are sRGB-encoded.
//
// provides  light_from(), write_light()        needs  paint_codes; the head: ENCODE_STEPS
// source    IEC 61966-2-1:1999, sections 5.2 and 5.3
//
// Both ways go by table, for pow() is a hundred times slower on PoCL. Every code has its light in the one; the other
// holds the curve at even steps of sqrt(light), where a straight line between two entries errs by less than 5e-8.

static inline WORK light_from(global const STORED *code, global const float *light_of) { return light_of[*code]; }

static inline void write_light(WORK light, global const float *srgb_of, global STORED *code) {
  const WORK within = light > (WORK)0 ? light < (WORK)1 ? light : (WORK)1 : (WORK)0;
  const WORK step = sqrt(within) * (WORK)ENCODE_STEPS;
  const int i = (int)step;
  const WORK before = srgb_of[i];
  const WORK curved = before + (step - i) * (srgb_of[i + 1] - before);
  write_ratio(within <= (WORK)0.0031308f ? within * (WORK)12.92f : curved, code);
}
