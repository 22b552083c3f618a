// paint_nearest.cl: take the picture pixel that holds the place, bit for bit.
//
// provides  sample()        needs  paint_picture, paint_unweighted, paint_places

static inline void sample(const picture_t *picture, PLACE s, PLACE t,
                          global STORED *colour SAMPLE_WEIGHTS SAMPLE_FOOTPRINT) {
  global const STORED *pixel = picture->pixels + nearest_pixel(picture, s, t);
  for (int c = 0; c < CHANNELS; ++c) colour[c] = pixel[c];
}
