// paint_floats_linear.cl: floats that are light. Nothing is cut off at 0 or 1.
//
// provides  light_from(), write_light()        needs  read_float(), write_float()

static inline WORK light_from(global const STORED *at, global const float *light_of) { return read_float(at); }

static inline void write_light(WORK light, global const float *srgb_of, global STORED *at) { write_float(light, at); }
