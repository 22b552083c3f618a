// paint_codes_linear.cl: integers that are proportional to light.
//
// provides  light_from(), write_light()        needs  paint_codes

static inline WORK light_from(global const STORED *code, global const float *light_of) { return ratio_from(code); }

static inline void write_light(WORK light, global const float *srgb_of, global STORED *code) {
  write_ratio(light, code);
}
