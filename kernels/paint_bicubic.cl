// paint_bicubic.cl: weights of the four samples around a place, on one axis.
//
// provides  TAPS, BASE, weigh()        needs  the head: WORK
// source    Keys, Cubic convolution interpolation for digital image processing, IEEE Trans. ASSP 29 (1981), eq. 15
//           (a = -1/2: the Catmull-Rom spline)

#define TAPS 4
#define BASE 1  // the tap at or before the place

// f in [0, 1) is the way from the base tap to the next. The base's own weight, 1 less the others, is never read.
static inline void weigh(WORK f, WORK weight[TAPS]) {
  const WORK half_f = f * (WORK)0.5f;
  weight[0] = half_f * (f * ((WORK)2 - f) - (WORK)1);
  weight[1] = (WORK)1 + half_f * f * ((WORK)3 * f - (WORK)5);
  weight[2] = half_f * (f * ((WORK)4 - (WORK)3 * f) + (WORK)1);
  weight[3] = half_f * f * (f - (WORK)1);
}
