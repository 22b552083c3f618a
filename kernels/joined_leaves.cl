// joined_leaves.cl: where the leaves of F may be zero along the ray.
//
// provides  SURFACE(zero_leaf)(), SURFACE(closed_zones)(), SURFACE(next_zones)()
// needs     prelude, functions, search, zones; SURFACE(LEAVES), SURFACE(IS_HARD)(), SURFACE(closed)(),
//           SURFACE(errors_within)(), SURFACE(errors_at)(), SURFACE(leaf_values)(), SURFACE(next_zone)()

// The number of the leaf that is zero where the ray starts: of their values in units of their errors the least. On an edge
// several may be zero, and none is taken to be.
static inline maskv SURFACE(zero_leaf)(const search_t *search, SURFACE(t) shape) {
  const real3v o = search->origin;
  const real3v size = {abs_v(o.x), abs_v(o.y), abs_v(o.z)};
  const realv drifts = (realv)(4 * REAL_EPSILON) * search->length;  // a point that was computed on another way as long
  const real3v drift = {drifts * abs_v(search->direction.x) + (realv)(4 * REAL_EPSILON) * size.x,
                        drifts * abs_v(search->direction.y) + (realv)(4 * REAL_EPSILON) * size.y,
                        drifts * abs_v(search->direction.z) + (realv)(4 * REAL_EPSILON) * size.z};
  realv value[SURFACE(LEAVES)], error[SURFACE(LEAVES)];
  SURFACE(leaf_values)(o, shape, value);
  SURFACE(errors_at)(size, drift, shape, error);
  realv nearest = (realv)REAL_MAX;
  maskv zero = (maskv)SURFACE(LEAVES), zeros = (maskv)0;
#pragma unroll
  for (int k = 0; k < SURFACE(LEAVES); ++k) {
    const realv off = abs_v(value[k]) / (error[k] + (realv)REAL_TINY);
    zero = off < nearest ? (maskv)k : zero;
    nearest = min_v(nearest, off);
    zeros += one_step(not_lane(off > (realv)1));
  }
  return zeros <= (maskv)1 ? zero : (maskv)SURFACE(LEAVES);
}

// The zones of the leaves whose roots are had in closed form; of `zero`, lanes' own leaf, a root at t = 0 is divided out.
static inline void SURFACE(closed_zones)(const search_t *search, SURFACE(t) shape, maskv zero,
                                         zone_t first[SURFACE(LEAVES)], zone_t second[SURFACE(LEAVES)]) {
  const real3v o = search->origin;
  const real3v way = {search->direction.x * search->length, search->direction.y * search->length,
                      search->direction.z * search->length};
  const real3v reach = {abs_v(o.x) + abs_v(way.x), abs_v(o.y) + abs_v(way.y), abs_v(o.z) + abs_v(way.z)};
  realv c[SURFACE(LEAVES)][3], noise[SURFACE(LEAVES)];
  SURFACE(closed)(o, way, shape, c);
  SURFACE(errors_within)(reach, shape, noise);
#pragma unroll
  for (int k = 0; k < SURFACE(LEAVES); ++k) {
    first[k] = second[k] = no_zone();
    if (SURFACE(IS_HARD)(k)) continue;
    const maskv departs = search->departs & (zero == (maskv)k);
    const realv scale = down_scale(noise[k]);
    const realv a[3] = {scale * (departs ? c[k][1] : c[k][0]), scale * (departs ? c[k][2] : c[k][1]),
                        departs ? (realv)0 : scale * c[k][2]};
    first[k] = zones_of(a, scale * noise[k], &second[k]);
    const maskv known = (noise[k] > (realv)(REAL_TINY / REAL_EPSILON)) & (noise[k] < (realv)MOST_NOISE);
    first[k].sign = known ? first[k].sign : (realv)0;
    first[k].low = known ? first[k].low : NEVER;
  }
}

// Search the leaves of higher degree from `clear` on, for lanes that ask for them, where they are not known up to `need`:
// to the end of the next zone of another leaf, where F may hang on them no longer.
static inline void SURFACE(next_zones)(search_t search, SURFACE(t) shape, maskv zero, maskv asks, realv clear, realv need,
                                       const zone_t second[SURFACE(LEAVES)], zone_t first[SURFACE(LEAVES)],
                                       realv until[SURFACE(LEAVES)], root_t *root) {
  realv end = (realv)1;
#pragma unroll
  for (int k = 0; k < SURFACE(LEAVES); ++k) {
    if (SURFACE(IS_HARD)(k)) continue;
    end = first[k].low > clear ? min_v(end, first[k].high) : end;
    end = second[k].low > clear ? min_v(end, second[k].high) : end;
  }
  end = max_v(end, need);
  const maskv departs = search.departs & (clear == (realv)0);
#pragma unroll
  for (int k = 0; k < SURFACE(LEAVES); ++k) {
    if (!SURFACE(IS_HARD)(k)) continue;
    search.lanes = asks & (until[k] < need);
    if (!any_lane(search.lanes)) continue;
    search.departs = departs & (zero == (maskv)k);
    const zone_t zone = SURFACE(next_zone)(k, search, shape, clear, end, root);
    first[k].sign = search.lanes ? zone.sign : first[k].sign;
    first[k].low = search.lanes ? zone.low : first[k].low;
    first[k].high = search.lanes ? zone.high : first[k].high;
    first[k].flips = search.lanes ? zone.flips : first[k].flips;
    until[k] = search.lanes ? (zone.low < NEVER ? zone.high : end) : until[k];
  }
}
