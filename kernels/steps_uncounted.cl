// steps_uncounted.cl: nobody asks how many steps the searches take.
//
// provides  count_steps(), COUNT_PARAMETERS, COUNT_ARGUMENTS        needs  ray

#define COUNT_PARAMETERS
#define COUNT_ARGUMENTS

static inline void count_steps(const hit_t *hit) {}
