// paint_codes.cl: integers from 0 to FULL_SCALE as ratios of it.
//
// provides  ratio_from(), write_ratio()        needs  the head: STORED, WORK, FULL_SCALE

static inline WORK ratio_from(global const STORED *code) { return (WORK)*code / (WORK)FULL_SCALE; }

// Rounds to the nearest code and holds it within the range; NaN cannot come out of integers.
static inline void write_ratio(WORK ratio, global STORED *code) {
  const WORK within = ratio > (WORK)0 ? ratio < (WORK)1 ? ratio : (WORK)1 : (WORK)0;
  *code = (STORED)(within * (WORK)FULL_SCALE + (WORK)0.5f);
}
