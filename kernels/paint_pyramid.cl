// paint_pyramid.cl: a picture in ever coarser levels, each pixel of one the mean of 2 x 2 of the level before.
//
// provides  kernel shrink; level_of()        needs  paint_picture; the head: PLACE, WORK, CHANNELS
// source    Williams, Pyramidal parametrics, SIGGRAPH 1983
//
// The levels lie behind each other in memory, the picture itself first. A pixel of level k covers 2^k x 2^k of the
// picture's, from its corner on, so a place in it is that in the picture over 2^k. Where a side is odd, the last pixel
// covers what is left, as if the edge went on outwards.

static inline int halved(int size) { return size - size / 2; }

// The level that is so many times coarser, as a picture of its own.
static inline picture_t level_of(const picture_t *picture, int number) {
  picture_t level = *picture;
  for (; number > 0; --number) {
    level.light += (long)level.width * level.height * CHANNELS;
    level.width = halved(level.width);
    level.height = halved(level.height);
  }
  return level;
}

// One work-item makes one pixel of level `number` from the one before.
kernel void shrink(const long count, const int number, const int width, const int height, global WORK *light) {
  const long pixel = get_global_id(0);
  if (pixel >= count) return;
  const picture_t whole = {width, height, 0, light, 0};
  const picture_t fine = level_of(&whole, number - 1), coarse = level_of(&whole, number);
  const int row = (int)(pixel / coarse.width), column = (int)(pixel - (long)row * coarse.width);
  global const WORK *a = fine.light + pixel_at(&fine, 2 * column, 2 * row);
  global const WORK *b = fine.light + pixel_at(&fine, 2 * column + 1, 2 * row);
  global const WORK *c = fine.light + pixel_at(&fine, 2 * column, 2 * row + 1);
  global const WORK *d = fine.light + pixel_at(&fine, 2 * column + 1, 2 * row + 1);
  global WORK *mean = light + (coarse.light - light) + pixel * CHANNELS;

  // As one of the four and a quarter of their differences: equal pixels stay exactly what they are
  for (int i = 0; i < CHANNELS; ++i) mean[i] = a[i] + ((b[i] - a[i]) + (c[i] - a[i]) + (d[i] - a[i])) * (WORK)0.25f;
}
