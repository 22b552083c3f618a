// paint_unweighted.cl: all light of a place reaches the film.
//
// provides  DIM(), KERNEL_WEIGHTS, SAMPLE_WEIGHTS, WEIGHTS_OF()

#define KERNEL_WEIGHTS
#define SAMPLE_WEIGHTS
#define WEIGHTS_OF(film_pixel)
#define DIM(light)
