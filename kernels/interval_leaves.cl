// interval_leaves.cl: how far F keeps its sign, and whether it has a single root, from the same of its leaves.
//
// provides  SURFACE(sight_t), SURFACE(see_values)(), SURFACE(see_slopes)(), SURFACE(leaf_at)()
// needs     interval, search, interval_leaf; SURFACE(joined)(), SURFACE(start_bands)(), SURFACE(slope_bands)()
//
// F joins smooth leaves by max and min. One number h says how far a leaf keeps its sign. If h > 0, the leaf is not negative
// on [0, h]; if h < 0, it is not positive on [0, -h]. Since max and min increase with their operands, F's number is the same
// max and min of its leaves' numbers. Let F have the other sign at a place, and let only one leaf be able to change its sign
// before it. Then F changes its sign where this leaf does, and once if the leaf does so once.

// What is proved of a segment. Places are measured from its start.
typedef struct {
  maskv sure[SURFACE(LEAVES)];   // leaves that keep their sign to the end, by their values alone
  realv holds[SURFACE(LEAVES)];  // h of each leaf
  maskv over;                    // F keeps its sign to the end
  maskv turned;                  // F has the other sign at the end
  maskv closes;                  // F has the other sign at `until`, where only one leaf has changed its sign
  maskv one;                     // F has a single root before `until`
  realv hold;                    // F keeps its sign up to here
  realv until;                   // the segment's length unless `closes`
  realv leaf;                    // the number of a leaf whose change of sign ends `hold`; -1 where none does
  realv fit;                     // as in leaf_t, of such leaves the least
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
  sight.hold = (realv)0;
  sight.leaf = (realv)-1;
  sight.until = length;
  sight.fit = HALF;
  return sight;
}

// The number of the only leaf that may change its sign on a segment, if F changes with it; else -1. Lanes of *asked where
// one or more may change are taken out: a wider segment would not tell more.
static inline realv SURFACE(leaf_at)(const band_t bands[SURFACE(LEAVES)], maskv lanes, maskv *asked) {
  realv above[SURFACE(LEAVES)], below[SURFACE(LEAVES)], leaf = (realv)-1;
  maskv open = (maskv)0;
#pragma unroll
  for (int k = 0; k < SURFACE(LEAVES); ++k) {
    const band_t band = band_settled(bands[k]);
    const maskv may = not_lane(abs_v(band.mid) - abs_v(band.rise) - band.error >= (realv)0);
    const realv sign = band.mid < (realv)0 ? (realv)-1 : (realv)1;
    above[k] = may ? (realv)1 : sign;
    below[k] = may ? (realv)-1 : sign;
    open += one_step(may);
    leaf = may ? (realv)k : leaf;
  }
  const maskv turns = SURFACE(joined)(above) * SURFACE(joined)(below) < (realv)0;
  const maskv tells = lanes & (open == (maskv)1) & turns;
  *asked = lanes & not_lane(tells) & not_lane(turns);
  return tells ? leaf : (realv)-1;
}

// Prove more in the lanes of `asks`, by bounds of the slopes. turned: lanes where F is known to have the other sign at the
// segment's end.
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

  // Of the leaves that may end `hold`, take the first that is proved to have changed its sign. F has changed its sign with
  // it if no other leaf may have changed before, and F has the other sign with all signs as they are then
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

  // Is there a single root before `until`?
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
