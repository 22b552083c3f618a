// interval_leaf.cl: how far along the segment one smooth leaf of F keeps its sign, by bounds of its slope.
//
// provides  SURFACE(leaf_t), SURFACE(see_leaves)(), ALONE
// needs     prelude, functions, search, interval, interval_polynomials; SURFACE(LEAVES), SURFACE(joined)()
//
// G is the leaf times its sign at the segment's start, so G is positive there. The slope of G lies between two parallel
// lines, so G lies between two parabolas,
//
//   G(0) - (falls +- wrong) t - bends t^2 / 2.
//
// G is positive before the first root of the lower parabola, and no longer at the first root of the upper one. It has a
// single root between the two if the upper bound of its slope is negative there. At a simple root of G the distance of the
// two shrinks with the third power of the segment's length.

#define LARGEST (REAL_MAX * REAL_EPSILON * REAL_EPSILON)  // slope has 8 REAL_EPSILON of its size in `wrong`
#define ALONE (SURFACE(LEAVES) == 1)  // then the leaf is F, whose sign at the start is known

// All places are measured from the segment's start.
typedef struct {
  realv sign;     // at the start
  realv holds;    // the leaf has this sign up to here
  realv flips;    // the leaf has the other sign here; the segment's length if no change of sign is proved
  realv falling;  // positive if G is proved to decrease all the way from `holds` to `flips`
  realv fit;      // a shorter segment, of this share of the length, would prove more
} SURFACE(leaf_t);

// From the band of the leaf at the start, and the band of its slope.
//
//   sign   as in leaf_t
//   zero   lanes where the leaf is 0 at the start
//   known  lanes where `sign` is proved in another way than by the band at the start
//   slack  bound on the rounding of a place
static inline __attribute__((always_inline)) SURFACE(leaf_t)
    SURFACE(leaf)(band_t start, band_t slope, realv sign, maskv zero, maskv known, realv length, realv half_length,
                  realv slack) {
  const realv level = sign * start.mid - start.error;
  const realv at_least = ALONE ? max_v(level, (realv)0) : (known ? max_v(level, (realv)0) : level);
  const realv level_low = zero ? (realv)0 : at_least;
  const realv level_high = zero ? (realv)0 : sign * start.mid + start.error;
  const realv wrong = slope.error + (realv)(8 * REAL_EPSILON) * (abs_v(slope.mid) + abs_v(slope.rise));
  const realv falls = sign * (slope.rise - slope.mid);  // at the start
  const realv bends = -sign * slope.rise;

  // Lower and upper bound of G's first root
  const realv unit = down_scale(max_v(max_v(abs_v(level_high), abs_v(falls) + wrong), abs_v(bends)));
  const realv sloped = unit * falls, doubt = unit * wrong, bent = unit * bends;
  const realv first = parabola_root(unit * level_low, sloped + doubt, bent, true) * half_length;
  const realv last = parabola_root(unit * level_high, sloped - doubt, bent, false) * half_length;
  const maskv knows = (level_high < (realv)LARGEST) & (wrong < (realv)LARGEST) & (level_low >= (realv)0) &
                      not_lane(zero & (falls + wrong >= (realv)0));
  const maskv stays = (first >= (realv)0) & (first <= length);
  const maskv closes = knows & stays & (last >= (realv)0) & (last < length);
  SURFACE(leaf_t) leaf;
  leaf.sign = sign;
  leaf.holds = knows ? (stays ? max_v(first - slack, (realv)0) : length) : (realv)0;
  leaf.flips = closes ? last : length;
  const realv surely = (falls - wrong) * half_length;
  leaf.falling = knows ? min_v(surely + bends * leaf.holds, surely + bends * leaf.flips) : (realv)0;

  // The slope's error shrinks with the square of the length: at this share it is half of the slope at the start
  leaf.fit = max_v((realv)NUMBER(0.125), min_v(HALF, sqrt(HALF * abs_v(falls) / wrong)));
  return leaf;
}

// The same for all leaves. Where a ray starts on the surface, one leaf is zero: the one that is nearest to zero in units
// of its error. On an edge several may be zero, and none is taken to be. Elsewhere F's sign is known. If only one leaf's
// sign is unknown there, and F would have the other sign with that leaf, then the leaf has F's sign.
static inline __attribute__((always_inline)) void
    SURFACE(see_leaves)(const band_t starts[SURFACE(LEAVES)], const band_t slopes[SURFACE(LEAVES)], realv side,
                        maskv on_root, realv length, realv half_length, realv slack,
                        SURFACE(leaf_t) leaf[SURFACE(LEAVES)]) {
  maskv departs = on_root, hinges = (maskv)0, zero = (maskv)0;
  if (!ALONE) {
    realv nearest = (realv)REAL_MAX, adverse[SURFACE(LEAVES)];
    maskv zeros = (maskv)0;
#pragma unroll
    for (int k = 0; k < SURFACE(LEAVES); ++k) {
      const realv off = abs_v(starts[k].mid) / starts[k].error;
      zero = off < nearest ? (maskv)k : zero;
      nearest = min_v(nearest, off);
      const maskv may = not_lane(off > (realv)1);
      zeros += one_step(may);
      adverse[k] = may ? -side : starts[k].mid;
    }
    departs = on_root & (zeros <= (maskv)1);
    hinges = not_lane(on_root) & (zeros == (maskv)1) & (side * SURFACE(joined)(adverse) < (realv)0);
  }
#pragma unroll
  for (int k = 0; k < SURFACE(LEAVES); ++k) {
    const maskv is_zero = ALONE ? departs : departs & (zero == (maskv)k);
    const maskv known = hinges & (zero == (maskv)k);
    const realv own = starts[k].mid < (realv)0 ? (realv)-1 : (realv)1;
    const realv sign = ALONE ? side : ((is_zero | known) ? side : own);
    leaf[k] = SURFACE(leaf)(starts[k], slopes[k], sign, is_zero, known, length, half_length, slack);
  }
}
