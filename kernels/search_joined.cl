// search_joined.cl: the first root of polynomials joined by max and min, from where each leaf may be zero.
//
// provides  SURFACE(isolate)()
// needs     prelude, functions, search, zones, joined_leaves; SURFACE(LEAVES), SURFACE(joined)(), SURFACE(IS_HARD)()
//
// Max and min rise with their operands. So F has a sign for certain if it has that sign with all leaves that are not known
// at their worst. Up to `clear` F holds its sign, by proof. The ray's next place of interest is the zone in which a leaf
// may be zero that begins first. F holds its sign up to there; does it do so through the zone? If not, and if F surely
// has the other sign once this leaf has changed its own, then F changes its sign with this leaf, and the root is found.
// Near an edge two zones overlap, and neither need be true: the ray is undecided.
//
// Zones of leaves of degree 1 and 2 are known from the start, in closed form. Those of the others are searched only where
// F hangs on them: a polynomial that is cut by a ball is searched in the ball.

#ifndef EVENT_LIMIT
#define EVENT_LIMIT 256  // zones and searches; usual are 3 to 8
#endif

static inline root_t SURFACE(isolate)(search_t search, SURFACE(t) shape, const method_t *method) {
  const realv side = search.inside ? (realv)-1 : (realv)1;
  maskv scans = search.lanes & (search.length > (realv)0);
  root_t root = no_root();
  root.undecided = search.lanes & not_lane(scans) & search.inside;
  maskv zero = (maskv)SURFACE(LEAVES);
  if (any_lane(scans & search.departs)) zero = SURFACE(zero_leaf)(&search, shape);
  zone_t first[SURFACE(LEAVES)], second[SURFACE(LEAVES)];
  SURFACE(closed_zones)(&search, shape, zero, first, second);
  realv until[SURFACE(LEAVES)];  // a leaf's sign is known up to here, but for its zone
#pragma unroll
  for (int k = 0; k < SURFACE(LEAVES); ++k) until[k] = SURFACE(IS_HARD)(k) ? (realv)-1 : NEVER;
  realv clear = (realv)0, need = (realv)0;
  maskv asks = (maskv)0;

  for (int i = 0; i < EVENT_LIMIT && any_lane(scans); ++i) {
    const maskv steps = scans & not_lane(asks);
    if (!any_lane(steps)) {
      SURFACE(next_zones)(search, shape, zero, asks, clear, need, second, first, until, &root);
      asks = (maskv)0;
      continue;
    }
    root.steps += one_step(steps);

    // The zone that begins first; the ray's end where there is none
    realv low = (realv)1, high = (realv)1, number = (realv)0;
    maskv leaf = (maskv)SURFACE(LEAVES), flips = (maskv)0;
#pragma unroll
    for (int k = 0; k < SURFACE(LEAVES); ++k) {
      const maskv is_first = first[k].low < low;
      low = is_first ? first[k].low : low;
      high = is_first ? first[k].high : high;
      leaf = is_first ? (maskv)k : leaf;
      number = is_first ? (realv)k : number;
      flips = is_first ? first[k].flips : flips;
    }

    // F before it, through it and behind it, with leaves that are not known all the way at their worst
    realv before[SURFACE(LEAVES)], through[SURFACE(LEAVES)], behind[SURFACE(LEAVES)];
    maskv stale = (maskv)0;
#pragma unroll
    for (int k = 0; k < SURFACE(LEAVES); ++k) {
      const maskv own = leaf == (maskv)k;
      const maskv ended = SURFACE(IS_HARD)(k) ? not_lane(own) & (until[k] < high) : (maskv)0;
      const maskv open = not_lane(own) & (ended | (first[k].low <= high) | (first[k].sign == (realv)0));
      stale = stale | ended;
      before[k] = open ? -side : first[k].sign;
      through[k] = own ? -side : before[k];
      behind[k] = open ? side : (own ? -first[k].sign : first[k].sign);
    }
    const maskv holds = side * SURFACE(joined)(before) > (realv)0;
    const maskv over = steps & (side * SURFACE(joined)(through) > (realv)0);
    const maskv found = steps & holds & not_lane(over) & flips & (side * SURFACE(joined)(behind) < (realv)0);
    const maskv waits = steps & stale & not_lane(over | found);
    const maskv passes = over & (leaf == (maskv)SURFACE(LEAVES));
    const maskv lost = steps & not_lane(over | found | waits);
    const realv held = holds ? max_v(low, clear) : clear;

    // Keep the root, or where it is not known any more. A bracket from 0 says that the root there is divided out
    const maskv departs = search.departs & (zero == leaf);
    const realv from = max_v(low, departs ? (realv)0 : (realv)REAL_EPSILON * high);
    root.found = root.found | found;
    root.low = found ? from : root.low;
    root.high = found ? high : root.high;
    root.leaf = found ? number : root.leaf;
    root.undecided = root.undecided | lost | (passes & search.inside);
    root.t = found ? (realv)NUMBER(0.5) * (from + high) : (lost ? held : root.t);

    // Go on behind the zone, or ask
    clear = over ? max_v(high, clear) : (waits ? held : clear);
    need = waits ? high : need;
    asks = asks | waits;
    scans = scans & not_lane(found | lost | passes);
#pragma unroll
    for (int k = 0; k < SURFACE(LEAVES); ++k) {
      const maskv taken = over & (leaf == (maskv)k);
      first[k].sign = (taken & first[k].flips) ? -first[k].sign : first[k].sign;
      first[k].low = taken ? second[k].low : first[k].low;
      first[k].high = taken ? second[k].high : first[k].high;
      first[k].flips = taken ? second[k].flips : first[k].flips;
      second[k].low = taken ? NEVER : second[k].low;
    }
  }
  root.undecided = root.undecided | scans;
  root.t = (root.undecided & scans ? clear : root.t) * search.length;
  root.low = root.low * search.length;
  root.high = root.high * search.length;
  return root;
}
