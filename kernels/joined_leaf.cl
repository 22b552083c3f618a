// joined_leaf.cl: where a leaf of degree 3 or more, a polynomial, first may be zero on a part of the ray.
//
// provides  SURFACE(next_zone)()
// needs     prelude, functions, search, zones, polynomial_ray, polynomial_bounds, search_polynomial; SURFACE(name) is the
//           leaf's own version of a name

// From `start` to `end`, in units of the ray's length. Lanes of search.departs have a known root at `start`. What is not
// known up to the end is a zone up to there.
static inline zone_t SURFACE(next_zone)(search_t search, SURFACE(t) shape, realv start, realv end, root_t *looks) {
  const real3v way = {search.direction.x * search.length, search.direction.y * search.length,
                      search.direction.z * search.length};
  search.origin = at3(search.origin, way, start);
  search.direction = way;
  search.length = end - start;
  search.inside = (maskv)0;
  realv a[SURFACE(DEGREE) + 1];
  maskv known;
  const realv noise = SURFACE(on_unit_ray)(&search, shape, a, &known);
  const maskv negative = a[0] < (realv)0;
#pragma unroll
  for (int i = 0; i <= SURFACE(DEGREE); ++i) a[i] = negative ? -a[i] : a[i];

  // Its first root on this part, if it is surely not zero at the start
  const maskv sure = search.lanes & known & (a[0] > noise);
  root_t root = no_root();
  maskv open = sure;
  SURFACE(guess)(a, noise, &open, &root);
  maskv passes = sure & not_lane(open | root.found);
  const maskv guessed = root.found;
  if (any_lane(open)) passes = passes | SURFACE(walk)(a, noise, open, &root);
  looks->steps += root.steps;

  // Newton's step, then how far off that may be: all over a bracket that was guessed and proved, the slope is no less than
  // a third of what it is at any place of it
  realv low = root.low, high = root.high;
  if (any_lane(guessed)) {
    realv f, df, half_ddf;
    SURFACE(jet)(a, root.t, &f, &df, &half_ddf);
    const realv t = min_v(max_v(root.t - f / df, root.low), root.high);
    SURFACE(jet)(a, t, &f, &df, &half_ddf);
    const realv off = (realv)3 * (abs_v(f) + noise + noise) / -df;
    low = guessed ? max_v(t - off, low) : low;
    high = guessed ? min_v(t + off, high) : high;
  }
  const realv slack = (realv)(4 * REAL_EPSILON) * end;
  const realv from = root.found ? max_v(low, (realv)0) : (sure ? root.t : (realv)0);
  zone_t zone;
  zone.sign = negative ? (realv)-1 : (realv)1;
  zone.low = passes ? NEVER : max_v(start + search.length * from - slack, start);
  zone.high = root.found ? start + search.length * high + slack : end;
  zone.flips = root.found;
  return zone;
}
