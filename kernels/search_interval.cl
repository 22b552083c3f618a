// search_interval.cl: the first root by bounds of F and of its slope on segments of the ray; no crossing is missed.
//
// provides  SURFACE(isolate)()
// needs     prelude, functions, interval, search, SURFACE(band)(), SURFACE(slope_band)()
// source    Mitchell, Robust ray intersection with interval arithmetic, Graphics Interface 1990, for the tests of
//           sign and slope; the bands' own lines say where to look next
//
// See F as G, positive on the ray's side. Ahead of `clear` there is no crossing, by proof. A segment from there on is
//   without a crossing  if G's band is nowhere negative, or if G rises all along (it is not negative at the start);
//   with exactly one    if G falls all along and is negative at its end.
// Otherwise the bands' lines say up to where G is positive and from where it is negative, which closes in on a simple
// root as fast as Newton's method; else the segment is halved. A ray that departs from the surface knows G = 0 at
// t = 0: it goes on from where G has only risen, so there is neither a tolerance nor a least distance.
//
// Nothing here has a length of its own: scaling a scene by a power of two scales every number and changes no decision.

#ifndef SCAN_LIMIT
#define SCAN_LIMIT 4096  // segments; usual are 10. More only where F oscillates or its bounds say nothing: then UNDECIDED
#endif
#define FINEST ((realv)(8 * REAL_EPSILON))   // of t: a shorter segment has no places inside
#define ONE_ROOT ((realv)(64 * REAL_EPSILON))  // of t: crossings that are closer are one

static inline root_t SURFACE(isolate)(search_t search, SURFACE(t) shape, const method_t *method) {
  const realv side = search.inside ? (realv)-1 : (realv)1;
  const real3v o = search.origin;
  const real3v d = search.direction;
  const real3v error = {coordinate_error(o.x, d.x, search.length), coordinate_error(o.y, d.y, search.length),
                        coordinate_error(o.z, d.z, search.length)};
  realv clear = (realv)0;
  realv end = search.length;    // nothing is searched beyond: the box ends, or G is negative
  realv width = search.length;  // of the next segment
  maskv on_root = search.departs;
  maskv negative = (maskv)0;    // lanes where G is negative at the end
  maskv scans = search.lanes & (search.length > (realv)0);
  root_t root;
  root.found = (maskv)0;
  root.undecided = search.lanes & not_lane(scans) & search.inside;

  for (int i = 0; i < SCAN_LIMIT && any_lane(scans); ++i) {
    const realv stop = min_v(clear + width, end);
    const segment_t segment = make_segment(clear, stop);
    const band3_t p = {band_on_segment(o.x, d.x, error.x, segment), band_on_segment(o.y, d.y, error.y, segment),
                       band_on_segment(o.z, d.z, error.z, segment)};
    const band_t f = SURFACE(band)(p, shape);
    const realv g = side * f.mid;
    const realv rise = side * f.rise;

    // Where is G positive from the start on, and where negative up to the end?
    const realv slack = (realv)(4 * REAL_EPSILON) * stop;  // of a place found on the line, for its roundings
    const maskv none = not_lane(on_root) & (g - abs_v(rise) - f.error >= (realv)0);
    const maskv starts = not_lane(on_root | none) & (g - rise - f.error > (realv)0);
    const maskv ends = not_lane(none) & (g + rise + f.error < (realv)0);
    const realv along = segment.reach / -rise;
    const realv first = segment.mid + (g - f.error) * along - slack;
    const realv last = segment.mid + (g + f.error) * along + slack;
    realv next = starts ? min_v(max_v(clear, first), stop) : clear;

    // Ask the slope where the value alone is not enough
    maskv one = (maskv)0;
    maskv over = none;
    const maskv asks = scans & not_lane(none | (starts & not_lane(ends)));
    if (any_lane(asks)) {
      band_t df = SURFACE(slope_band)(p, d, shape);
      df.error *= (realv)(1 + INPUT_ROUNDINGS);  // each product with d counts its own rounding, so d's is in this
      const realv slope = side * df.mid;
      const realv bend = side * df.rise;
      const maskv rises = asks & (slope - abs_v(bend) - df.error > (realv)0);
      const maskv falls = asks & not_lane(on_root) & (slope + abs_v(bend) + df.error < (realv)0);
      over = over | rises | (falls & (g + rise - f.error >= (realv)0));
      one = falls & ends;

      // G rises up to where the slope's line may reach zero
      const maskv rises_first = asks & not_lane(rises) & (slope - bend - df.error > (realv)0);
      const realv up_to = segment.mid + (slope - df.error) * (segment.reach / -bend) - slack;
      next = rises_first ? max_v(next, min_v(up_to, stop)) : next;
      on_root = on_root & not_lane(rises | (rises_first & (next > clear)));
    }

    // Move on, close in, or halve
    const realv length = stop - clear;
    const maskv closes = scans & starts & ends;
    next = over ? stop : next;
    end = (scans & ends) ? (closes ? min_v(max_v(last, next), stop) : stop) : end;
    negative = negative | (scans & ends);
    const maskv gains = next - clear > (realv)NUMBER(0.25) * length;
    const maskv narrow = closes & (end - next < HALF * length);
    const realv rest = length - (next - clear);
    const realv left = starts ? max_v(rest, min_v(last - next, length)) : rest;  // a root may lie just behind the stop
    width = over ? (realv)2 * length : (narrow ? end - next : (gains ? left : HALF * length));
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

  root.t = root.found ? HALF * (clear + end) : clear;
  root.low = clear;
  root.high = end;
  return root;
}
