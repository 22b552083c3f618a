// paint_footprint.cl: a film pixel is the parallelogram on the picture that its ray covers, to first order.
//
// provides  sample()
// needs     paint_picture, paint_levels, paint_footprints; mix_light(), DIM(), SAMPLE_WEIGHTS, from_light(); the head:
//           PLACE, WORK, CHANNELS
// source    the footprint is Heckbert's (Fundamentals of Texture Mapping and Image Warping, 1989, sec. 3.5), its probes
//           on a pyramid those of McCormack, Perry, Farkas & Jouppi, Feline, SIGGRAPH 1999
//
// Rows and columns of probes stand evenly in the pixel, and each looks at the picture by the filter asked for: their
// mean is what many rays a pixel would see, and what Heckbert's ellipse is to second order. No inverse is lost at a
// fold, and where neither side is longer than half a picture pixel a single probe is left: the plain filter. A pyramid
// bounds the work.

#define MOST_PROBES 16  // in a row or column of them: what is longer in pixels of a level goes to a coarser one
#define FINE_PROBES 8   // up to so many they stand half a pixel of the level apart, then up to a whole one
#define MOST_ACROSS 8   // pixels of a level across a footprint's narrow side; half as many on the next are enough

typedef struct {
  PLACE x, y;  // in picture pixels
} step_t;

// A step is cut where it leads across the picture and beyond, so that no square overflows.
static inline PLACE cut(PLACE a, PLACE most) { return a < -most ? -most : a > most ? most : a; }

static inline PLACE length_of(step_t step) { return sqrt(step.x * step.x + step.y * step.y); }

// The narrow side of the footprint: the smaller singular value of its two steps.
static inline PLACE narrow_side(step_t a, step_t b) {
  const PLACE sum = a.x * a.x + a.y * a.y + b.x * b.x + b.y * b.y;
  const PLACE across = a.x * a.x + b.x * b.x - a.y * a.y - b.y * b.y, skew = (PLACE)2 * (a.x * a.y + b.x * b.y);
  const PLACE wide = sqrt((PLACE)0.5f * (sum + sqrt(across * across + skew * skew)));
  const PLACE area = a.x * b.y - a.y * b.x;
  return wide > (PLACE)0 ? (area < (PLACE)0 ? -area : area) / wide : (PLACE)0;
}

static inline int probes_along(PLACE length) {
  const int close = (int)ceil((PLACE)2 * length), far = (int)ceil(length);
  const int wanted = close < FINE_PROBES ? close : far < FINE_PROBES ? FINE_PROBES : far;
  return wanted < 1 ? 1 : wanted > MOST_PROBES ? MOST_PROBES : wanted;
}

static inline void sample(const picture_t *picture, PLACE s, PLACE t,
                          global STORED *colour SAMPLE_WEIGHTS SAMPLE_FOOTPRINT) {
  const PLACE width = picture->width, height = picture->height;
  const PLACE most = (PLACE)2 * (width + height);
  const step_t down = {cut(jacobian[0] * width, most), cut(jacobian[2] * height, most)};
  const step_t right = {cut(jacobian[1] * width, most), cut(jacobian[3] * height, most)};
  const PLACE narrow = narrow_side(down, right), rows_long = length_of(down), columns_long = length_of(right);
  const PLACE longer = rows_long > columns_long ? rows_long : columns_long;

  // Take the level on which the narrow side is still resolved, or the long one in as many probes as there may be
  int number = 0;
  PLACE size = (PLACE)1;  // of a pixel of the level
  while (size < (width > height ? width : height) && (narrow >= MOST_ACROSS * size || longer > MOST_PROBES * size)) {
    size *= (PLACE)2;
    ++number;
  }
  const picture_t level = level_of(picture, number);
  const int rows = probes_along(rows_long / size), columns = probes_along(columns_long / size);

  // The mean of the probes, as the first and their differences from it
  WORK first[CHANNELS], sum[CHANNELS], light[CHANNELS];
  for (int i = 0; i < rows; ++i) {
    for (int j = 0; j < columns; ++j) {
      const PLACE u = ((PLACE)i + (PLACE)0.5f) / rows - (PLACE)0.5f;
      const PLACE v = ((PLACE)j + (PLACE)0.5f) / columns - (PLACE)0.5f;
      const PLACE x = s * width + u * down.x + v * right.x, y = t * height + u * down.y + v * right.y;
      const PLACE x_held = x < (PLACE)0 ? (PLACE)0 : x > width ? width : x;
      const PLACE y_held = y < (PLACE)0 ? (PLACE)0 : y > height ? height : y;
      mix_light(&level, x_held / size, y_held / size, light);
      for (int c = 0; c < CHANNELS; ++c) {
        if (i + j == 0) first[c] = light[c], sum[c] = (WORK)0;
        sum[c] += light[c] - first[c];
      }
    }
  }
  const WORK share = (WORK)1 / (WORK)(rows * columns);
  for (int c = 0; c < CHANNELS; ++c) light[c] = first[c] + share * sum[c];
  DIM(light);
  from_light(light, picture->srgb_of, picture->pixels + nearest_pixel(picture, s, t), colour);
}
