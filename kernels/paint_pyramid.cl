// paint_pyramid.cl: make the levels of a pyramid, each pixel of one the mean of 2 x 2 of the level before.
//
// provides  kernel shrink        needs  paint_levels; the head: WORK, CHANNELS
// source    Williams, Pyramidal parametrics, SIGGRAPH 1983
//
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
