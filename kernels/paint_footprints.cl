// paint_footprints.cl: of a film pixel's ray it is known how its place on the picture changes with the pixel.
//
// provides  KERNEL_FOOTPRINTS, SAMPLE_FOOTPRINT, FOOTPRINT_OF()        needs  the head: PLACE
//
//   jacobians  d(s, t)/d(row, column), four numbers a film pixel: s by row, s by column, t by row, t by column

#define KERNEL_FOOTPRINTS , global const PLACE *restrict jacobians
#define SAMPLE_FOOTPRINT , global const PLACE *jacobian
#define FOOTPRINT_OF(film_pixel) , jacobians + (film_pixel) * 4
