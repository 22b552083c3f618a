// paint_point.cl: take the light of the picture pixel that holds a place.
//
// provides  mix_light()        needs  paint_picture; the head: PLACE, WORK, CHANNELS

// The light at a place, in pixels from the picture's corner.
static inline void mix_light(const picture_t *picture, PLACE right, PLACE down, WORK sum[CHANNELS]) {
  global const WORK *at = picture->light + pixel_at(picture, (int)right, (int)down);
  for (int c = 0; c < CHANNELS; ++c) sum[c] = at[c];
}
