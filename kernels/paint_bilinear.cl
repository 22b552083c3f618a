// paint_bilinear.cl: weights of the two samples around a place, on one axis.
//
// provides  TAPS, BASE, weigh()        needs  the head: WORK

#define TAPS 2
#define BASE 0  // the tap at or before the place

// f in [0, 1) is the way from the base tap to the next. The base's own weight, 1 less the others, is never read.
static inline void weigh(WORK f, WORK weight[TAPS]) {
  weight[0] = (WORK)1 - f;
  weight[1] = f;
}
