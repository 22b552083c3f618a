// paint_places.cl: of a film pixel's ray only the place is known where it lands.
//
// provides  KERNEL_FOOTPRINTS, SAMPLE_FOOTPRINT, FOOTPRINT_OF()

#define KERNEL_FOOTPRINTS
#define SAMPLE_FOOTPRINT
#define FOOTPRINT_OF(film_pixel)
