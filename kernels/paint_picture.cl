// paint_picture.cl: the picture as memory.
//
// provides  picture_t, pixel_at(), nearest_pixel()
// needs     the head: PLACE, STORED the pixels' bits as an unsigned type, WORK float|double, CHANNELS 1..4
//
// Pixels are handled as bits, so a copied colour is the same to the last bit.

typedef struct {
  int width, height;
  global const STORED *pixels;   // rows from the top, pixels from the left, channels together
  global const WORK *light;      // the same pixels as linear light, ready to be mixed
  global const float *srgb_of;   // the sRGB curve over sqrt(light)
} picture_t;

static inline int held_within(int i, int size) { return i < 0 ? 0 : i >= size ? size - 1 : i; }

// Where the pixel in a column and row begins; beyond the edges, the pixel on the edge.
static inline long pixel_at(const picture_t *picture, int column, int row) {
  const long row_start = (long)held_within(row, picture->height) * picture->width;
  return (row_start + held_within(column, picture->width)) * CHANNELS;
}

// Where the pixel begins whose area holds (s, t): column floor(s W), row floor(t H).
static inline long nearest_pixel(const picture_t *picture, PLACE s, PLACE t) {
  return pixel_at(picture, (int)(s * picture->width), (int)(t * picture->height));
}
