// paint_opaque.cl: every channel is mixed as it stands: no alpha, or colour already multiplied by it.
//
// provides  to_light(), from_light()        needs  light_from(), write_light(); the head: STORED, WORK, CHANNELS

static inline void to_light(global const STORED *pixel, global const float *light_of, global WORK *light) {
  for (int c = 0; c < CHANNELS; ++c) light[c] = light_from(pixel + c, light_of);
}

static inline void from_light(const WORK light[CHANNELS], global const float *srgb_of, global const STORED *nearest,
                              global STORED *colour) {
  for (int c = 0; c < CHANNELS; ++c) write_light(light[c], srgb_of, colour + c);
}
