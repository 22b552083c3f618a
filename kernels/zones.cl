// zones.cl: where along the ray a polynomial may be zero; outside of its zones its sign is known.
//
// provides  zone_t, no_zone(), zones_of(), NEVER        needs  prelude, functions
//
// t is in units of the ray's length, so that places are in [0, 1].

#define NEVER ((realv)2)

typedef struct {
  realv sign;       // before the zone, 1 or -1; 0 where it is not known anywhere
  realv low, high;  // the polynomial may be zero between them only; no other zone begins before `high`
  maskv flips;      // lanes where it changes its sign there once; else whether and how often is not known
} zone_t;

static inline zone_t no_zone(void) {
  const zone_t zone = {(realv)1, NEVER, NEVER, (maskv)0};
  return zone;
}

// The zones of a[0] + a[1] t + a[2] t^2 in [0, 1], of which all values there may be wrong by `noise`: the first is
// returned, the second is put into *second. The noise must be about 1, for squares of coefficients are taken.
//
// Let r be a computed root and s the size of the slope there. The true polynomial changes its sign once between r - d and
// r + d, if s d - |a2| d^2 is more than |f(r)| and the noise, and if the slope does not change its sign there. With
// d = 2 (|f(r)| + 4 noise) / s both hold where 4 |a2| d <= s. A pair of roots that is too near for that is one zone round
// the place where the slope is zero, as wide as |f| may be no more than the noise.
static inline zone_t zones_of(const realv a[3], realv noise, zone_t *second) {
  const realv size = abs_v(a[0]), slope_size = abs_v(a[1]), bend = abs_v(a[2]);
  const maskv starts_on = not_lane(size > noise);
  const realv square = a[1] * a[1] - (realv)4 * a[0] * a[2];
  const realv doubt = (realv)NUMBER(2.5) * noise * max_v(slope_size, (realv)2 * max_v(size, bend));
  const maskv never = (size - slope_size - bend > (realv)2 * noise) | (square < -doubt);

  // Two roots
  const realv between = sqrt(max_v(square, (realv)0));
  const realv tip = (realv)NUMBER(-0.5) * (a[1] + (a[1] < (realv)0 ? -between : between));
  const realv one = tip / a[2], other = a[0] / tip;
  const realv roots[2] = {one < other ? one : other, one < other ? other : one};
  realv reach[2];
  maskv behind[2];  // roots before the start, if they are near it
  maskv simple = square > doubt;
#pragma unroll
  for (int i = 0; i < 2; ++i) {
    const realv t = roots[i];
    const realv rises = a[1] + (realv)2 * a[2] * t, slope = abs_v(rises);
    behind[i] = not_lane(starts_on) & (rises * a[0] > (realv)0);
    const realv off = (realv)2 * (abs_v(a[0] + t * (a[1] + t * a[2])) + (realv)4 * noise) / slope;
    reach[i] = off + (realv)(4 * REAL_EPSILON) * abs_v(t);
    simple = simple & not_lane((realv)4 * bend * off > slope);
  }
  zone_t first = no_zone();
  *second = no_zone();
  zone_t zones[2];
#pragma unroll
  for (int i = 0; i < 2; ++i) {
    zones[i] = no_zone();
    const realv low = roots[i] - reach[i], high = roots[i] + reach[i];
    const maskv meets = simple & not_lane(never | (behind[i] & (low <= (realv)0))) & (high > (realv)0) & (low < (realv)1);
    zones[i].low = meets ? low : NEVER;
    zones[i].high = meets ? high : NEVER;
    zones[i].flips = meets;
  }
  const maskv is_second = not_lane(zones[0].flips);  // the first is behind, or ahead of all
  first.low = is_second ? zones[1].low : zones[0].low;
  first.high = is_second ? zones[1].high : zones[0].high;
  first.flips = zones[0].flips | zones[1].flips;
  second->low = is_second ? NEVER : zones[1].low;
  second->high = is_second ? NEVER : zones[1].high;
  second->flips = zones[1].flips & not_lane(is_second);
  const realv falls = a[1] > (realv)0 ? (realv)-1 : (realv)1;
  const realv own = a[0] < (realv)0 ? (realv)-1 : (realv)1;
  first.sign = starts_on ? falls : own;

  // A touch; or no sign at all, as on a ray in a plane
  const maskv touches = not_lane(never | simple);
  if (any_lane(touches)) {
    const realv middle = (realv)NUMBER(-0.5) * a[1] / a[2];
    const realv wide = (realv)2 * sqrt(((realv)4 * noise + abs_v(square) / ((realv)4 * bend)) / bend);
    const maskv placed = (wide < (realv)1) & (abs_v(middle) < (realv)4);
    const maskv meets = placed & (middle + wide > (realv)0) & (middle - wide < (realv)1);
    const realv out = a[2] < (realv)0 ? (realv)-1 : (realv)1;
    first.sign = touches ? (placed ? (starts_on ? out : own) : (realv)0) : first.sign;
    first.low = touches ? (meets ? middle - wide : NEVER) : first.low;
    first.high = touches ? (meets ? middle + wide : NEVER) : first.high;
    first.flips = touches ? (first.sign * out < (realv)0) : first.flips;
  }
  second->sign = -first.sign;
  return first;
}
