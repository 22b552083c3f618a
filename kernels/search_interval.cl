// search_interval.cl: the first root by bounds of F and of its slope on segments of the ray; no crossing is missed.
//
// provides  SURFACE(isolate)()
// needs     prelude, functions, interval, interval_polynomials, search, SURFACE(on_segment)(), SURFACE(band)(),
//           SURFACE(start_band)(), SURFACE(slope_band)()
// source    Mitchell, Robust ray intersection with interval arithmetic, Graphics Interface 1990, for the tests of
//           sign and slope; Kalra & Barr, Guaranteed ray intersections with implicit surfaces, SIGGRAPH 1989, for steps
//           that pass no root. Here the slope's band is a line, and so its integral a parabola
//
// See F as G, positive on the ray's side. Ahead of `clear` there is no crossing, by proof: G(clear) >= 0. On a segment
// from there on G' lies between two parallel lines, so G between two parabolas,
//
//   G(clear) - (falls +- wrong) t - bends t^2 / 2,
//
// and no crossing is before the lower one's first root, which becomes `clear`. Up to the upper one's first root there is
// one, and it is the only one if the upper line is negative between the two. Both roots close in on a simple crossing
// with the third power of the segment's length. Where they say too little, a shorter segment is seen. A ray that departs
// from the surface knows G = 0 at t = 0: it goes on from where G has only risen, so there is neither a tolerance nor a
// least distance.
//
// t is in units of the ray's length in the box, and by halves of the segment in its parabolas: nothing here has a length
// of its own, and scaling a scene by a power of two scales every number and changes no decision.

#ifndef SCAN_LIMIT
#define SCAN_LIMIT 4096  // segments; usual are 3. More only where F oscillates or its bounds say nothing: then UNDECIDED
#endif
#define LARGEST (REAL_MAX * REAL_EPSILON * REAL_EPSILON)  // slope has 8 REAL_EPSILON of its size in `wrong`
#define FINEST ((realv)(8 * REAL_EPSILON))   // of t: a shorter segment has no places inside
#define ONE_ROOT ((realv)(64 * REAL_EPSILON))  // of t: crossings that are closer are one

static inline root_t SURFACE(isolate)(search_t search, SURFACE(t) shape, const method_t *method) {
  const realv side = search.inside ? (realv)-1 : (realv)1;
  realv clear = (realv)0;
  realv end = (realv)1;    // nothing is searched beyond: the box ends, or G is negative
  realv width = (realv)1;  // of the next segment
  maskv on_root = search.departs;
  maskv negative = (maskv)0;    // lanes where G is negative at the end
  maskv scans = search.lanes & (search.length > (realv)0);
  root_t root = no_root();
  root.undecided = search.lanes & not_lane(scans) & search.inside;

  for (int i = 0; i < SCAN_LIMIT && any_lane(scans); ++i) {
    root.steps += one_step(scans);

    // See the surface on the segment, from its middle
    const realv stop = min_v(clear + width, end);
    const realv length = stop - clear;
    const realv mid = HALF * (clear + stop);
    const realv half_length = max_v(stop - mid, mid - clear) * WIDEN;
    const SURFACE(parts_t) parts = SURFACE(on_segment)(&search, mid, half_length, shape);
    const band_t f = SURFACE(band)(&parts, shape);
    const realv g = side * f.mid;
    const realv rise = side * f.rise;
    maskv over = not_lane(on_root) & (g - abs_v(rise) - f.error >= (realv)0);
    maskv one = (maskv)0, closes = (maskv)0;
    realv next = clear, shrink = HALF;

    // Ask the slope where the value alone is not enough
    const maskv asks = scans & not_lane(over);
    if (any_lane(asks)) {
      realv level_low = (realv)0, level_high = (realv)0;
      if (any_lane(asks & not_lane(on_root))) {
        const band_t start = SURFACE(start_band)(&parts, shape);
        level_low = on_root ? (realv)0 : max_v(side * start.mid - start.error, (realv)0);
        level_high = on_root ? (realv)0 : side * start.mid + start.error;
      }
      const band_t slope = SURFACE(slope_band)(&parts, shape);
      const realv wrong = slope.error + (realv)(8 * REAL_EPSILON) * (abs_v(slope.mid) + abs_v(slope.rise));
      const realv falls = side * (slope.rise - slope.mid);  // at the start
      const realv bends = -side * slope.rise;

      // Where may G be zero first, and from where is it surely negative?
      const realv slack = (realv)(4 * REAL_EPSILON) * stop;  // of a place, for its roundings
      const realv unit = down_scale(max_v(max_v(abs_v(level_high), abs_v(falls) + wrong), abs_v(bends)));
      const realv sloped = unit * falls, doubt = unit * wrong, bent = unit * bends;
      const realv first = parabola_root(unit * level_low, sloped + doubt, bent, true) * half_length;
      const realv last = parabola_root(unit * level_high, sloped - doubt, bent, false) * half_length;
      const maskv knows = asks & (level_high < (realv)LARGEST) & (wrong < (realv)LARGEST) & not_lane(on_root & (falls + wrong >= (realv)0));
      const maskv stays = (first >= (realv)0) & (first <= length);
      over = over | (knows & not_lane(stays));
      next = (knows & stays) ? max_v(clear, clear + first - slack) : clear;

      // Does it change its sign between, and only once?
      const maskv meets = knows & stays;
      closes = meets & (last >= (realv)0) & (last < length);
      const maskv ends = asks & not_lane(over) & (closes | (g + rise + f.error < (realv)0) | (negative & (stop >= end)));
      const realv until = closes ? last : length;
      const realv surely = (falls - wrong) * half_length;
      const maskv falling = (surely + bends * (next - clear) > (realv)0) & (surely + bends * until > (realv)0);
      one = meets & ends & falling & not_lane(on_root & (next <= clear));
      end = ends ? (closes ? min_v(clear + last + slack, stop) : stop) : end;
      negative = negative | ends;
      on_root = on_root & not_lane(knows & (over | (next > clear)));

      // The slope's error shrinks with the square of the length; what it said of this segment is known by a half
      const realv fit = max_v((realv)NUMBER(0.125), min_v(HALF, sqrt(HALF * abs_v(falls) / wrong)));
      shrink = max_v((realv)2 * (next - clear) / length, fit);
    }

    // Move on, close in, or take less
    next = over ? stop : next;
    const maskv gains = next - clear > (realv)NUMBER(0.25) * length;
    const maskv narrow = closes & (end - next < HALF * length);
    const realv rest = length - (next - clear);
    width = over ? (realv)2 * length : (narrow ? end - next : (gains ? rest : shrink * length));
    clear = scans ? next : clear;

    // Be done: one root, none, or as fine as numbers are
    const maskv passed = scans & not_lane(one) & (clear >= end) & not_lane(negative);
    const maskv tiny = scans & not_lane(one | passed) & (width <= FINEST * (clear + width));
    const maskv point = tiny & negative & not_lane(on_root) & (end - clear <= ONE_ROOT * end);
    root.found = root.found | (scans & one) | point;
    root.undecided = root.undecided | (tiny & not_lane(point)) | (passed & search.inside);
    scans = scans & not_lane(one | passed | tiny);
  }
  root.undecided = root.undecided | scans;

  root.t = (root.found ? HALF * (clear + end) : clear) * search.length;
  root.low = clear * search.length;
  root.high = end * search.length;
  return root;
}
