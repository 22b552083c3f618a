// interval_leaves.cl: how long F holds its sign, and whether it crosses zero once, from what its leaves do.
//
// provides  SURFACE(sight_t), SURFACE(see_values)(), SURFACE(see_slopes)()
// needs     interval, search, interval_leaf; SURFACE(joined)(), SURFACE(start_bands)(), SURFACE(slope_bands)()
//
// F joins smooth leaves by max and min. Each leaf holds its sign for a while, which is told by a number: the leaf is not
// negative as far ahead as a positive one says, and not positive as far as the size of a negative one. Since max and min
// rise with their operands, F's own such number is joined of its leaves' as F is of their values. Where but one leaf may
// flip before a place at which F's sign is another, there is one root of F, and it is that leaf's.

// What is seen of a segment; places are measured from its start.
typedef struct {
  maskv sure[SURFACE(LEAVES)];   // leaves that hold their sign to the end, by their values alone
  realv holds[SURFACE(LEAVES)];  // of each leaf, as above
  maskv over;                    // F holds its sign to the end
  maskv turned;                  // F has another sign at the end
  maskv closes;                  // ... and at `until`, where only one leaf has flipped
  maskv one;                     // F has one root, and it lies before `until`
  realv hold;                    // so long F holds its sign
  realv until;
  realv leaf;                    // the number of the leaf that F waits for
  realv fit;                     // as of that leaf
} SURFACE(sight_t);

// From the leaves' bands on a segment; on_root: lanes where F is 0 at its start.
static inline SURFACE(sight_t)
    SURFACE(see_values)(const band_t bands[SURFACE(LEAVES)], realv side, maskv on_root, realv length) {
  SURFACE(sight_t) sight;
  realv ends_at[SURFACE(LEAVES)];
#pragma unroll
  for (int k = 0; k < SURFACE(LEAVES); ++k) {
    const band_t band = ALONE ? bands[k] : band_settled(bands[k]);
    sight.sure[k] = (ALONE ? side * band.mid : abs_v(band.mid)) - abs_v(band.rise) - band.error >= (realv)0;
    sight.holds[k] = sight.sure[k] ? (band.mid < (realv)0 ? -length : length) : (realv)0;
    ends_at[k] = band.mid + band.rise + side * band.error;
  }
  sight.over = not_lane(on_root) & (ALONE ? sight.sure[0] : side * SURFACE(joined)(sight.holds) >= length);
  sight.turned = side * SURFACE(joined)(ends_at) < (realv)0;
  sight.closes = sight.one = (maskv)0;
  sight.hold = sight.leaf = (realv)0;
  sight.until = length;
  sight.fit = HALF;
  return sight;
}

// Say more of the lanes that ask. turned: lanes where F is known to have another sign at the segment's end.
static inline __attribute__((always_inline)) void
    SURFACE(see_slopes)(const SURFACE(parts_t) *parts, SURFACE(t) shape, realv side, maskv asks, maskv on_root,
                        maskv turned, realv length, realv half_length, realv slack, SURFACE(sight_t) *sight) {
  band_t starts[SURFACE(LEAVES)], slopes[SURFACE(LEAVES)];
  SURFACE(leaf_t) leaf[SURFACE(LEAVES)];
#pragma unroll
  for (int k = 0; k < SURFACE(LEAVES); ++k) starts[k].mid = starts[k].rise = starts[k].error = (realv)0;
  if (!ALONE || any_lane(asks & not_lane(on_root))) SURFACE(start_bands)(parts, shape, starts);
#pragma unroll
  for (int k = 0; k < SURFACE(LEAVES); ++k) starts[k] = ALONE ? starts[k] : band_settled(starts[k]);
  SURFACE(slope_bands)(parts, shape, slopes);
  SURFACE(see_leaves)(starts, slopes, side, on_root, length, half_length, slack, leaf);
#pragma unroll
  for (int k = 0; k < SURFACE(LEAVES); ++k) {
    if (!ALONE) leaf[k].sign = sight->sure[k] ? (sight->holds[k] < (realv)0 ? (realv)-1 : (realv)1) : leaf[k].sign;
    if (!ALONE) leaf[k].holds = sight->sure[k] ? length : leaf[k].holds;
    sight->holds[k] = leaf[k].sign * leaf[k].holds;
  }
  sight->hold = ALONE ? leaf[0].holds : max_v(side * SURFACE(joined)(sight->holds), (realv)0);
  sight->over = sight->over | (asks & (sight->hold >= length));

  // The first flip of those that F waits for is one of F if no other leaf may flip before, and F has another sign then
  realv until = length;
#pragma unroll
  for (int k = 0; k < SURFACE(LEAVES); ++k) {
    const maskv waits = ALONE ? asks : not_lane(sight->sure[k]) & (leaf[k].holds <= sight->hold);
    until = waits ? min_v(until, leaf[k].flips) : until;
    sight->leaf = waits ? (realv)k : sight->leaf;
    sight->fit = waits ? min_v(sight->fit, leaf[k].fit) : sight->fit;
  }
  realv signs[SURFACE(LEAVES)];
  maskv flips = (maskv)0;
#pragma unroll
  for (int k = 0; k < SURFACE(LEAVES); ++k) {
    const maskv may = leaf[k].holds < until;
    flips += one_step(may);
    signs[k] = may ? -leaf[k].sign : leaf[k].sign;
  }
  const maskv turns = ALONE ? asks : (flips == (maskv)1) & (side * SURFACE(joined)(signs) < (realv)0);
  const maskv open = asks & not_lane(sight->over);
  sight->closes = open & (until < length) & turns;
  sight->turned = open & (sight->closes | sight->turned | turned);
  sight->until = sight->closes ? until : length;

  // Is there one root before that place, or before the segment's end?
  maskv falls = sight->turned;
  flips = (maskv)0;
#pragma unroll
  for (int k = 0; k < SURFACE(LEAVES); ++k) {
    const maskv may = leaf[k].holds < sight->until;
    const maskv once = (leaf[k].falling > (realv)0) & (leaf[k].flips >= sight->until);
    flips += one_step(may);
    falls = falls & (ALONE ? once : not_lane(may) | once);
  }
  sight->one = falls & (ALONE ? falls : flips == (maskv)1);
}
