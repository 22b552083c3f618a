// paint_levels.cl: where the levels of a pyramid lie in memory.
//
// provides  level_of()        needs  paint_picture; the head: CHANNELS
// source    Williams, Pyramidal parametrics, SIGGRAPH 1983
//
// The levels lie behind each other, the picture itself first. A pixel of level k covers 2^k x 2^k of the picture's, from
// its corner on, so a place in it is that in the picture over 2^k. Where a side is odd, the last pixel covers what is
// left, as if the edge went on outwards.

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
