// steps_counted.cl: add up how many searches a work-item makes, and how many steps they take.
//
// provides  count_steps(), COUNT_PARAMETERS, COUNT_ARGUMENTS        needs  lanes, ray
//
// counts holds two numbers a work-item, searches and steps. A work-item's rays are too few to fill 32 bits.

#define COUNT_PARAMETERS , global uint *restrict counts
#define COUNT_ARGUMENTS , counts

static inline uint sum_of_lanes(maskv v) {
  uint sum = 0;
#if VW == 1
  sum = (uint)v;
#else
  for (int lane = 0; lane < VW; ++lane) sum += (uint)((const MASK *)&v)[lane];
#endif
  return sum;
}

static inline void count_steps(const hit_t *hit, global uint *restrict counts) {
  counts[2 * get_global_id(0)] += sum_of_lanes(hit->searches);
  counts[2 * get_global_id(0) + 1] += sum_of_lanes(hit->steps);
}
