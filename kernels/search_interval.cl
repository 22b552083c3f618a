// search_interval.cl: the first root by bounds of F and of its slope on segments of the ray; no crossing is missed.
//
// provides  SURFACE(isolate)()
// needs     prelude, functions, interval, search, interval_leaves, SURFACE(on_segment)(), SURFACE(leaf_at)(); SURFACE(LEAVES), SURFACE(bands)()
// source    Mitchell, Robust ray intersection with interval arithmetic, Graphics Interface 1990, for the tests of
//           sign and slope; Kalra & Barr, Guaranteed ray intersections with implicit surfaces, SIGGRAPH 1989, for steps
//           that pass no root. Here the slope's band is a line, and so its integral a parabola
//
// Up to `clear` F holds its sign, by proof. On a segment from there on its leaves are seen: `clear` moves on as far as F
// still holds it, and where it says too little, a shorter segment is seen. A ray that departs from the surface knows that
// a leaf is zero at t = 0: it goes on from where that leaf has only risen, so there is neither a tolerance nor a least
// distance.
//
// t is in units of the ray's length in the box, and by halves of the segment in its parabolas: nothing here has a length
// of its own, and scaling a scene by a power of two scales every number and changes no decision.

#ifndef SCAN_LIMIT
#define SCAN_LIMIT 4096  // segments; usual are 1 to 3, more where F oscillates or its bounds say nothing: then UNDECIDED
#endif
#define WIDER_LIMIT 12  // times, each of 4, that the neighbourhood of a root grows in which its leaf is looked for
#define FINEST ((realv)(8 * REAL_EPSILON))   // of t: a shorter segment has no places inside
#define ONE_ROOT ((realv)(64 * REAL_EPSILON))  // of t: crossings that are closer are one

static inline root_t SURFACE(isolate)(search_t search, SURFACE(t) shape, const method_t *method) {
  const realv side = search.inside ? (realv)-1 : (realv)1;
  realv clear = (realv)0;
  realv end = (realv)1;    // nothing is searched beyond: the box ends, or F has another sign
  realv width = (realv)1;  // of the next segment
  maskv on_root = search.departs;
  maskv turned = (maskv)0;  // lanes where F has another sign at the end
  maskv scans = search.lanes & (search.length > (realv)0);
  root_t root = no_root();
  if (!ALONE) root.leaf = (realv)-1;
  root.undecided = search.lanes & not_lane(scans) & search.inside;

  for (int i = 0; i < SCAN_LIMIT && any_lane(scans); ++i) {
    root.steps += one_step(scans);

    // See F on the segment, from its middle; ask the slopes where the values alone are not enough
    const realv stop = min_v(clear + width, end);
    const realv length = stop - clear;
    const realv mid = HALF * (clear + stop);
    const realv half_length = max_v(stop - mid, mid - clear) * WIDEN;
    const realv slack = (realv)(4 * REAL_EPSILON) * stop;
    const SURFACE(parts_t) parts = SURFACE(on_segment)(&search, mid, half_length, shape);
    band_t bands[SURFACE(LEAVES)];
    SURFACE(bands)(&parts, shape, bands);
    SURFACE(sight_t) sight = SURFACE(see_values)(bands, side, on_root, length);
    const maskv asks = scans & not_lane(sight.over);
    realv next = clear, shrink = HALF;
    maskv one = (maskv)0;
    if (any_lane(asks)) {
      SURFACE(see_slopes)(&parts, shape, side, asks, on_root, turned & (stop >= end), length, half_length, slack, &sight);
      next = clear + sight.hold;
      one = sight.one & not_lane(on_root & (next <= clear));
      end = sight.turned ? (sight.closes ? min_v(clear + sight.until + slack, stop) : stop) : end;
      turned = turned | sight.turned;
      on_root = on_root & not_lane(sight.over | (next > clear));
      root.leaf = asks ? sight.leaf : root.leaf;
      shrink = max_v((realv)2 * sight.hold / length, sight.fit);
    }

    // Move on, close in, or take less
    next = sight.over ? stop : next;
    const maskv gains = next - clear > (realv)NUMBER(0.25) * length;
    const maskv narrow = sight.closes & (end - next < HALF * length);
    const realv rest = length - (next - clear);
    width = sight.over ? (realv)2 * length : (narrow ? end - next : (gains ? rest : shrink * length));
    clear = scans ? next : clear;

    // Be done: one root, none, or as fine as numbers are
    const maskv passed = scans & not_lane(one) & (clear >= end) & not_lane(turned);
    const maskv tiny = scans & not_lane(one | passed) & (width <= FINEST * (clear + width));
    const maskv point = tiny & turned & not_lane(on_root) & (end - clear <= ONE_ROOT * end);
    root.found = root.found | (scans & one) | point;
    root.undecided = root.undecided | (tiny & not_lane(point)) | (passed & search.inside);
    scans = scans & not_lane(one | passed | tiny);
  }
  root.undecided = root.undecided | scans;

  // Where the last looks knew the signs of all leaves, the root is that of the only one that is 0 next to it
  if (!ALONE) {
    maskv asked = root.found & (root.leaf < (realv)0);
    realv reach = (realv)(8 * REAL_EPSILON) * end;
    for (int i = 0; i < WIDER_LIMIT && any_lane(asked); ++i) {
      const SURFACE(parts_t) parts =
          SURFACE(on_segment)(&search, HALF * (clear + end), HALF * (end - clear) + reach, shape);
      band_t bands[SURFACE(LEAVES)];
      SURFACE(bands)(&parts, shape, bands);
      const realv leaf = SURFACE(leaf_at)(bands, asked, &asked);
      root.leaf = leaf >= (realv)0 ? leaf : root.leaf;
      reach = (realv)4 * reach;
    }
    const maskv faceless = root.found & (root.leaf < (realv)0);
    root.found = root.found & not_lane(faceless);
    root.undecided = root.undecided | faceless;
    root.leaf = max_v(root.leaf, (realv)0);
  }

  root.t = (root.found ? HALF * (clear + end) : clear) * search.length;
  root.low = clear * search.length;
  root.high = end * search.length;
  return root;
}
