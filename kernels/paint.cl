// paint.cl: colour every film pixel from the place on the picture that its ray found.
//
// provides  kernel paint
// needs     paint_picture, sample(), KERNEL_WEIGHTS, WEIGHTS_OF(), KERNEL_FOOTPRINTS, FOOTPRINT_OF(); the head: PLACE
//           float|double, ON_PICTURE the status of a ray that landed
//
// One work-item colours one film pixel.
kernel void paint(const long count, global const PLACE *restrict places, global const uchar *restrict status,
                  const int width, const int height, global const STORED *restrict pixels,
                  global const WORK *restrict light, global const float *restrict srgb_of,
                  global const STORED *restrict outside,
                  global STORED *restrict painted KERNEL_WEIGHTS KERNEL_FOOTPRINTS) {
  const long film_pixel = get_global_id(0);
  if (film_pixel >= count) return;
  global STORED *colour = painted + film_pixel * CHANNELS;

  // A ray that did not land takes the colour outside
  if (status[film_pixel] != ON_PICTURE) {
    for (int c = 0; c < CHANNELS; ++c) colour[c] = outside[c];
    return;
  }

  const picture_t picture = {width, height, pixels, light, srgb_of};
  sample(&picture, places[2 * film_pixel], places[2 * film_pixel + 1],
         colour WEIGHTS_OF(film_pixel) FOOTPRINT_OF(film_pixel));
}
