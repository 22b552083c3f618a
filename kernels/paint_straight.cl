// paint_straight.cl: the last channel is alpha, and colour is stored without it.
//
// provides  to_light(), from_light()
// needs     light_from(), write_light(); ratio_from(), write_ratio(); the head: STORED, WORK, CHANNELS
// source    Porter & Duff, Compositing digital images, SIGGRAPH 1984, section 3
//
// Colour is mixed multiplied by alpha: what a transparent pixel hides must not show as a fringe.

#define ALPHA (CHANNELS - 1)

static inline void to_light(global const STORED *pixel, global const float *light_of, global WORK *light) {
  const WORK alpha = ratio_from(pixel + ALPHA);
  for (int c = 0; c < ALPHA; ++c) light[c] = light_from(pixel + c, light_of) * alpha;
  light[ALPHA] = alpha;
}

static inline void from_light(const WORK light[CHANNELS], global const float *srgb_of, global const STORED *nearest,
                              global STORED *colour) {
  write_ratio(light[ALPHA], colour + ALPHA);

  // Where nothing can be seen there is no colour to divide out: keep the nearest pixel's
  const int unseen = colour[ALPHA] == 0;
  for (int c = 0; c < ALPHA; ++c) {
    if (unseen)
      colour[c] = nearest[c];
    else
      write_light(light[c] / light[ALPHA], srgb_of, colour + c);
  }
}
