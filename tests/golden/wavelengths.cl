// lenses   prism
// rays     point
// method   interval finds every crossing, by proof; a ray whose proof rounding forbids is undecided
// snell    exact
// effects  follow_total_reflection, dispersion
// numbers  double, 8 to a packet

#define REAL double
#define MASK long
#define VW 8
#define REAL_MAX DBL_MAX
#define REAL_TINY DBL_MIN
#define REAL_EPSILON DBL_EPSILON
#define NUMBER(x) x
#define INPUT_ROUNDINGS 0
#define RUN 1
#define RAY_WORDS 11
#define RAY_CARRIES

#define RAY_PICTURE 0
#define RAY_OFF_PICTURE 1
#define RAY_BEHIND 2
#define RAY_TOTAL_REFLECTION 3
#define RAY_TRAPPED 4
#define RAY_UNDECIDED 5
#define RAY_BLOCKED 6

// ... lanes.cl
// ... prelude.cl
// ... functions.cl
// ... waves.cl
// ... memory.cl
#line 1 "generated"
// the numbers of a scene, which a sweep may change without a new kernel

typedef struct {
  real corner[3];         // outer corner of pixel (0, 0)
  real column_step[3];    // from a pixel to the one on its right
  real row_step[3];       // from a pixel to the one below
} film_t;

typedef struct {
  real at[3];
  real inside;            // number of the lens it lies in, or -1
  real on;                // number of the lens on whose surface it lies, or -1
} source_t;

typedef struct {
  real corner[3];
  real normal[3];         // unit
  real dual_s[3];         // 1 along right, 0 along down
  real dual_t[3];         // 0 along right, 1 along down
} picture_t;

typedef struct {
  real none;              // a C structure holds at least one number
} method_t;

typedef struct {
  real to_local[9];       // rows of the linear map
  real to_world[9];       // rows of its inverse
  real centre[3];         // world
  real box_low[3];        // local; the solid lies strictly inside the box
  real box_high[3];
  real n;                 // refractive index
  real eta_in;            // index around it over its own
  real eta_out;           // its own over the one around it
} lens_t;

typedef struct {
  real apex;              // angle at the apex, degrees
  real side;              // from the apex to the base, along either side
  real length;            // along x
} prism_t;

typedef struct {
  film_t film;
  source_t source;
  picture_t picture;
  method_t method;
  real n_medium;          // index around the lenses
  lens_t lens_0;
  prism_t shape_0;
} scene_t;

// ... ray.cl
// ... film.cl
// ... rays_point.cl
// ... placement.cl
// ... search.cl
// ... interval.cl
// ... interval_polynomials.cl
// ... interval_arithmetic.cl
// ... interval_curves.cl
// ... interval_powers.cl
// ... interval_cbrt.cl
// ... interval_functions.cl
#line 1 "generated"
// a surface, from its expression

// prism: max(y*sin(apex/2) + abs(z)*cos(apex/2) - side/3*sin(apex), -y - side/3*cos(apex/2), abs(x) - [...]; negative inside
typedef struct {
  linear_t part_0;
  linear_t part_1;
  linear_t part_2;
  linear_t part_3;
  linear_t part_4;
} prism_parts_t;

static inline prism_parts_t prism_parts(real3v origin, real3v along, real3v reach, real3v drift, prism_t shape) {
  const real product1 = 0.008726646259971648 * shape.apex;   // 0.008726646259971648 * apex
  const real sin1 = sin(product1);   // sin(0.008726646259971648 * apex)
  const realv product2 = sin1 * origin.y;   // sin(0.008726646259971648 * apex) * origin_y
  const real cos1 = cos(product1);   // cos(0.008726646259971648 * apex)
  const realv product3 = cos1 * origin.z;   // cos(0.008726646259971648 * apex) * origin_z
  const real product4 = 0.6666666666666666 * shape.side * sin1 * cos1;   // 0.6666666666666666 * side * sin1 * cos1
  const realv product5 = sin1 * along.y;   // sin(0.008726646259971648 * apex) * along_y
  const realv product6 = cos1 * along.z;   // cos(0.008726646259971648 * apex) * along_z
  const real size1 = sin1 < 0.0 ? -sin1 : sin1;   // abs(sin(0.008726646259971648 * apex))
  const real size2 = cos1 < 0.0 ? -cos1 : cos1;   // abs(cos(0.008726646259971648 * apex))
  const real size3 = product4 < 0.0 ? -product4 : product4;   // abs(product4)
  const realv product7 = (18.0 + 16.0 * INPUT_ROUNDINGS) * REAL_EPSILON;   // (18 + 16 * INPUT_ROUNDINGS) * REAL_EPSILON
  // product7 * (size1 * reach_y + size2 * reach_z + size3)
  const realv product8 = product7 * (size1 * reach.y + size2 * reach.z + size3);
  const realv sum1 = product8 + (size1 * drift.y + size2 * drift.z);   // product8 + (size1 * drift_y + size2 * drift_z)
  // 0.3333333333333333 * side * cos(0.008726646259971648 * apex)
  const real product9 = 0.3333333333333333 * shape.side * cos1;
  const realv product10 = (14.0 + 12.0 * INPUT_ROUNDINGS) * REAL_EPSILON;   // (14 + 12 * INPUT_ROUNDINGS) * REAL_EPSILON
  // abs(0.3333333333333333 * side * cos(0.008726646259971648 * apex))
  const real size4 = product9 < 0.0 ? -product9 : product9;
  const real product11 = 0.5 * shape.length;   // 0.5 * length
  const real size5 = product11 < 0.0 ? -product11 : product11;   // abs(0.5 * length)
  const realv sum2 = product10 * (reach.x + size5) + drift.x;   // product10 * (reach_x + size5) + drift_x
  prism_parts_t parts;
  parts.part_0.c[0] = product2 + product3 - product4;
  parts.part_0.c[1] = product5 + product6;
  parts.part_0.error = (sum1) + UNDERFLOW;
  parts.part_1.c[0] = product2 - product3 - product4;
  parts.part_1.c[1] = product5 - product6;
  parts.part_1.error = (sum1) + UNDERFLOW;
  parts.part_2.c[0] = -origin.y - product9;
  parts.part_2.c[1] = -along.y;
  parts.part_2.error = (product10 * (reach.y + size4) + drift.y) + UNDERFLOW;
  parts.part_3.c[0] = origin.x - product11;
  parts.part_3.c[1] = along.x;
  parts.part_3.error = (sum2) + UNDERFLOW;
  parts.part_4.c[0] = -origin.x - product11;
  parts.part_4.c[1] = -along.x;
  parts.part_4.error = (sum2) + UNDERFLOW;
  return parts;
}

#define prism_LEAVES 5
static inline realv prism_joined(const realv of_leaf[prism_LEAVES]) { return max_v(max_v(max_v(of_leaf[0], of_leaf[1]), of_leaf[2]), max_v(of_leaf[3], of_leaf[4])); }

static inline void prism_bands(const prism_parts_t *parts, prism_t shape, band_t of_leaf[prism_LEAVES]) {
  const band_t part_0 = band_of_linear(parts->part_0);
  const band_t part_1 = band_of_linear(parts->part_1);
  const band_t part_2 = band_of_linear(parts->part_2);
  const band_t part_3 = band_of_linear(parts->part_3);
  const band_t part_4 = band_of_linear(parts->part_4);
  of_leaf[0] = part_0;
  of_leaf[1] = part_1;
  of_leaf[2] = part_2;
  of_leaf[3] = part_3;
  of_leaf[4] = part_4;
}

static inline void prism_start_bands(const prism_parts_t *parts, prism_t shape, band_t of_leaf[prism_LEAVES]) {
  const band_t part_0 = start_of_linear(parts->part_0);
  const band_t part_1 = start_of_linear(parts->part_1);
  const band_t part_2 = start_of_linear(parts->part_2);
  const band_t part_3 = start_of_linear(parts->part_3);
  const band_t part_4 = start_of_linear(parts->part_4);
  of_leaf[0] = part_0;
  of_leaf[1] = part_1;
  of_leaf[2] = part_2;
  of_leaf[3] = part_3;
  of_leaf[4] = part_4;
}

static inline void prism_slope_bands(const prism_parts_t *parts, prism_t shape, band_t of_leaf[prism_LEAVES]) {
  const band_t part_0_slope = slope_of_linear(parts->part_0);
  const band_t part_1_slope = slope_of_linear(parts->part_1);
  const band_t part_2_slope = slope_of_linear(parts->part_2);
  const band_t part_3_slope = slope_of_linear(parts->part_3);
  const band_t part_4_slope = slope_of_linear(parts->part_4);
  of_leaf[0] = part_0_slope;
  of_leaf[1] = part_1_slope;
  of_leaf[2] = part_2_slope;
  of_leaf[3] = part_3_slope;
  of_leaf[4] = part_4_slope;
}

#define SURFACE(name) prism_##name

// ... interval_segment.cl
// ... interval_leaf.cl
// ... interval_leaves.cl
// ... search_interval.cl
// ... newton.cl
// ... root_polished.cl
// ... ahead_box.cl
// ... lens.cl
// ... total_possible.cl
// ... snell_exact.cl
// ... screen.cl
// ... ends_map.cl
// ... effects/mirrored.cl
// ... effects/follow_total_reflection.cl
#line 1 "generated"
// what this scene consists of

static inline void start(ray_t *ray, const scene_t *scene) {
  lens_0_start(ray, &scene->lens_0, scene->shape_0);
}

static inline void meet_lenses(const ray_t *ray, const scene_t *scene, hit_t *hit) {
  lens_0_meet(ray, &scene->lens_0, scene->shape_0, &scene->method, hit);
}

static inline void at_interface(ray_t *ray, const interface_t *at, const scene_t *scene) {
  follow_total_reflection_interface(ray, at, scene);
}

static inline void at_picture(ray_t *ray, const place_t *place, const scene_t *scene) {
}

#define EFFECT_PARAMETERS
#define EFFECT_ARGUMENTS
static inline void store_effects(const ray_t *ray, int first EFFECT_PARAMETERS) {
}

// ... layer.cl
// ... effects/dispersion.cl
// ... parks_never.cl
// ... steps_uncounted.cl
// ... trace.cl
