// distinct.cl: the numbers of lenses that a packet's lanes hold, one after the other, and what a table has of each.
//
// provides  largest_lane(), numbers_of_lenses(), numbers_of_rows()        needs  prelude
//
// Numbers of lenses are whole numbers of the mask's width, up to 2^24, so that single precision holds them.

// The largest number of all lanes: -1 where none has a lens.
static inline int largest_lane(maskv m) {
#if VW == 32
  const PASTE(MASK, 16) by_16 = m.lo > m.hi ? m.lo : m.hi;
  const PASTE(MASK, 8) by_8 = by_16.lo > by_16.hi ? by_16.lo : by_16.hi;
  const PASTE(MASK, 4) by_4 = by_8.lo > by_8.hi ? by_8.lo : by_8.hi;
#elif VW == 16
  const PASTE(MASK, 8) by_8 = m.lo > m.hi ? m.lo : m.hi;
  const PASTE(MASK, 4) by_4 = by_8.lo > by_8.hi ? by_8.lo : by_8.hi;
#elif VW == 8
  const PASTE(MASK, 4) by_4 = m.lo > m.hi ? m.lo : m.hi;
#elif VW == 4
  const maskv by_4 = m;
#endif
#if VW == 1
  return (int)m;
#elif VW == 2
  return (int)(m.x > m.y ? m.x : m.y);
#else
  const PASTE(MASK, 2) by_2 = by_4.lo > by_4.hi ? by_4.lo : by_4.hi;
  return (int)(by_2.x > by_2.y ? by_2.x : by_2.y);
#endif
}

static inline int is_number_of_lens(real number, int lenses) { return number >= (real)0 && number < (real)lenses; }

// One number of each lane's own lens, of so many: the word-th of its record; of some lens for lanes that have none, as are
// those that fill a packet up.
static inline realv numbers_of_lenses(maskv lens, int lenses, int word, global const real *table,
                                      global const int2 *records) {
  real at[VW], found[VW];
  store_lanes(to_numbers(lens), at);
  for (int i = 0; i < VW; ++i) {
    const int place = is_number_of_lens(at[i], lenses) ? records[(int)at[i]].x : 0;
    found[i] = table[place + word];
  }
  return load_lanes(found);
}

// The first number of each lane's own row, of so many numbers; of some row for lanes that have no lens.
static inline realv numbers_of_rows(maskv lens, int lenses, global const real *rows, int stride) {
  real at[VW], found[VW];
  store_lanes(to_numbers(lens), at);
  for (int i = 0; i < VW; ++i) found[i] = rows[is_number_of_lens(at[i], lenses) ? stride * (int)at[i] : 0];
  return load_lanes(found);
}
