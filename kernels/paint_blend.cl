// paint_blend.cl: mix the samples around a place in linear light.
//
// provides  mix_light()        needs  paint_picture; TAPS, BASE, weigh(); the head: PLACE, WORK, CHANNELS
//
// Samples stand at (i + 1/2) / W. Each mix starts from its base sample and adds weighted differences, so equal samples
// give exactly themselves, whatever the weights' rounding. A sample of weight 0 is not looked at: a NaN or Inf reaches
// only places whose mix includes it.

// sum += weight (value - base), channel by channel.
static inline void add_difference(WORK sum[CHANNELS], const WORK base[CHANNELS], const WORK value[CHANNELS],
                                  WORK weight) {
  for (int c = 0; c < CHANNELS; ++c) sum[c] += weight == (WORK)0 ? (WORK)0 : weight * (value[c] - base[c]);
}

static inline void fetch(const picture_t *picture, int column, int row, WORK value[CHANNELS]) {
  global const WORK *at = picture->light + pixel_at(picture, column, row);
  for (int c = 0; c < CHANNELS; ++c) value[c] = at[c];
}

// Mix one row of taps.
static inline void blend_row(const picture_t *picture, int column, int row, const WORK across[TAPS],
                             WORK sum[CHANNELS]) {
  WORK base[CHANNELS], value[CHANNELS];
  fetch(picture, column, row, base);
  for (int c = 0; c < CHANNELS; ++c) sum[c] = base[c];
  for (int tap = 0; tap < TAPS; ++tap) {
    if (tap == BASE) continue;
    fetch(picture, column + tap - BASE, row, value);
    add_difference(sum, base, value, across[tap]);
  }
}

// The light at a place, in pixels from the picture's corner.
static inline void mix_light(const picture_t *picture, PLACE right, PLACE down, WORK sum[CHANNELS]) {
  // Find the base sample; x >= -1/2, so cutting off the fraction rounds down but for the first half pixel
  const PLACE x = right - (PLACE)0.5f, y = down - (PLACE)0.5f;
  const int column = x < (PLACE)0 ? -1 : (int)x, row = y < (PLACE)0 ? -1 : (int)y;
  WORK across[TAPS], along[TAPS];
  weigh((WORK)(x - column), across);
  weigh((WORK)(y - row), along);

  // Mix each row, then the rows
  WORK base[CHANNELS], value[CHANNELS];
  blend_row(picture, column, row, across, base);
  for (int c = 0; c < CHANNELS; ++c) sum[c] = base[c];
  for (int tap = 0; tap < TAPS; ++tap) {
    if (tap == BASE) continue;
    blend_row(picture, column, row + tap - BASE, across, value);
    add_difference(sum, base, value, along[tap]);
  }
}
