// paint_weighted.cl: a part of a place's light reaches the film, colour by colour. Alpha is no light.
//
// provides  DIM(), KERNEL_WEIGHTS, SAMPLE_WEIGHTS, WEIGHTS_OF()        needs  the head: WORK, COLOURS the channels but alpha

#define KERNEL_WEIGHTS , global const WORK *restrict weights
#define SAMPLE_WEIGHTS , global const WORK *weight
#define WEIGHTS_OF(film_pixel) , weights + (film_pixel) * COLOURS
#define DIM(light) \
  for (int c = 0; c < COLOURS; ++c) light[c] *= weight[c]
