// paint_point.cl: take the light of the picture pixel that holds the place, and dim it.
//
// provides  sample()        needs  paint_picture, paint_weighted; from_light(); the head: PLACE, WORK, CHANNELS

static inline void sample(const picture_t *picture, PLACE s, PLACE t, global STORED *colour SAMPLE_WEIGHTS) {
  const long pixel = nearest_pixel(picture, s, t);
  WORK light[CHANNELS];
  for (int c = 0; c < CHANNELS; ++c) light[c] = picture->light[pixel + c];
  DIM(light);
  from_light(light, picture->srgb_of, picture->pixels + pixel, colour);
}
