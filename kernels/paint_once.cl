// paint_once.cl: a film pixel is one place on the picture.
//
// provides  sample()
// needs     paint_picture, paint_places; mix_light(), DIM(), SAMPLE_WEIGHTS, from_light(); the head: PLACE, WORK,
//           CHANNELS

static inline void sample(const picture_t *picture, PLACE s, PLACE t,
                          global STORED *colour SAMPLE_WEIGHTS SAMPLE_FOOTPRINT) {
  WORK light[CHANNELS];
  mix_light(picture, s * picture->width, t * picture->height, light);
  DIM(light);
  from_light(light, picture->srgb_of, picture->pixels + nearest_pixel(picture, s, t), colour);
}
