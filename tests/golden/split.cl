// lenses   heart
// rays     point
// method   interval finds every crossing, by proof; a ray whose proof rounding forbids is undecided
// snell    exact
// effects  follow_total_reflection, fresnel, fresnel_front, reflected_place
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
#define RAY_WORDS 15
#define RAY_CARRIES realv transmittance; realv reflectance; realv reflected_s; realv reflected_t;

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
  real none;              // a C structure holds at least one number
} heart_t;

typedef struct {
  film_t film;
  source_t source;
  picture_t picture;
  method_t method;
  real n_medium;          // index around the lenses
  lens_t lens_0;
  heart_t shape_0;
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

// heart: (2*x^2 + 2*y^2 + z^2 - 1)^3 - x^2*z^3/10 - y^2*z^3; negative inside
typedef struct {
  linear_t part_0;
  quadratic_t part_1;
  quadratic_t part_2;
  cbrt_t part_2_root;
} heart_parts_t;

static inline heart_parts_t heart_parts(real3v origin, real3v along, real3v reach, real3v drift, heart_t shape) {
  const realv origin_x2 = origin.x * origin.x;   // origin_x^2
  const realv origin_y2 = origin.y * origin.y;   // origin_y^2
  const realv along_x2 = along.x * along.x;   // along_x^2
  const realv along_y2 = along.y * along.y;   // along_y^2
  const realv reach_x2 = reach.x * reach.x;   // reach_x^2
  const realv reach_y2 = reach.y * reach.y;   // reach_y^2
  // 2 * reach_x^2 + 2 * reach_y^2 + reach_z^2 + 1
  const realv sum1 = 2.0 * reach_x2 + 2.0 * reach_y2 + reach.z * reach.z + 1.0;
  // 4 * reach_x * drift_x + 4 * reach_y * drift_y + 2 * reach_z * drift_z
  const realv sum2 = 4.0 * reach.x * drift.x + 4.0 * reach.y * drift.y + 2.0 * reach.z * drift.z;
  // (24 + 20 * INPUT_ROUNDINGS) * REAL_EPSILON * (0.1 * reach_x2 + reach_y2)
  const realv product1 = (24.0 + 20.0 * INPUT_ROUNDINGS) * REAL_EPSILON * (0.1 * reach_x2 + reach_y2);
  heart_parts_t parts;
  parts.part_0.c[0] = origin.z;
  parts.part_0.c[1] = along.z;
  parts.part_0.error = ((4.0 + 2.0 * INPUT_ROUNDINGS) * REAL_EPSILON * reach.z + drift.z) + UNDERFLOW;
  parts.part_1.c[0] = 2.0 * origin_x2 + 2.0 * origin_y2 + origin.z * origin.z - 1.0;
  parts.part_1.c[1] = 4.0 * origin.x * along.x + 4.0 * origin.y * along.y + 2.0 * origin.z * along.z;
  parts.part_1.c[2] = 2.0 * along_x2 + 2.0 * along_y2 + along.z * along.z;
  parts.part_1.error = ((28.0 + 24.0 * INPUT_ROUNDINGS) * REAL_EPSILON * sum1 + sum2) + UNDERFLOW;
  parts.part_2.c[0] = 0.1 * origin_x2 + origin_y2;
  parts.part_2.c[1] = 0.2 * origin.x * along.x + 2.0 * origin.y * along.y;
  parts.part_2.c[2] = 0.1 * along_x2 + along_y2;
  parts.part_2.error = (product1 + (0.2 * reach.x * drift.x + 2.0 * reach.y * drift.y)) + UNDERFLOW;
  parts.part_2_root = cbrt_of(parts.part_2);
  return parts;
}

#define heart_LEAVES 1
static inline realv heart_joined(const realv of_leaf[heart_LEAVES]) { return of_leaf[0]; }

static inline void heart_bands(const heart_parts_t *parts, heart_t shape, band_t of_leaf[heart_LEAVES]) {
  const band_t part_0 = band_of_linear(parts->part_0);
  const band_t part_1 = band_of_quadratic(parts->part_1);
  const band_t part_2_root = band_of_cbrt(parts->part_2_root);
  of_leaf[0] = band_subtract(part_1, band_multiply(part_0, part_2_root));
}

static inline void heart_start_bands(const heart_parts_t *parts, heart_t shape, band_t of_leaf[heart_LEAVES]) {
  const band_t part_0 = start_of_linear(parts->part_0);
  const band_t part_1 = start_of_quadratic(parts->part_1);
  const band_t part_2_root = start_of_cbrt(parts->part_2_root);
  of_leaf[0] = band_subtract(part_1, band_multiply(part_0, part_2_root));
}

static inline void heart_slope_bands(const heart_parts_t *parts, heart_t shape, band_t of_leaf[heart_LEAVES]) {
  const band_t part_0 = band_of_linear(parts->part_0);
  const band_t part_2_root = band_of_cbrt(parts->part_2_root);
  const band_t part_0_slope = slope_of_linear(parts->part_0);
  const band_t part_1_slope = slope_of_quadratic(parts->part_1);
  const band_t part_2_root_slope = slope_of_cbrt(parts->part_2_root);
  const band_t part_0_slope_part_2_root = band_multiply(part_0_slope, part_2_root);   // part_0_slope * part_2_root
  // part_0_slope * part_2_root + part_0 * part_2_root_slope
  const band_t sum1 = band_add(part_0_slope_part_2_root, band_multiply(part_0, part_2_root_slope));
  of_leaf[0] = band_subtract(part_1_slope, sum1);
}

#define SURFACE(name) heart_##name

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
// ... effects/fresnel.cl
// ... effects/fresnel_front.cl
// ... effects/reflected_place.cl
#line 1 "generated"
// what this scene consists of

static inline void start(ray_t *ray, const scene_t *scene) {
  lens_0_start(ray, &scene->lens_0, scene->shape_0);
  fresnel_start(ray, scene);
  fresnel_front_start(ray, scene);
  reflected_place_start(ray, scene);
}

static inline void meet_lenses(const ray_t *ray, const scene_t *scene, hit_t *hit) {
  lens_0_meet(ray, &scene->lens_0, scene->shape_0, &scene->method, hit);
}

static inline void at_interface(ray_t *ray, const interface_t *at, const scene_t *scene) {
  follow_total_reflection_interface(ray, at, scene);
  fresnel_interface(ray, at, scene);
  fresnel_front_interface(ray, at, scene);
  reflected_place_interface(ray, at, scene);
}

static inline void at_picture(ray_t *ray, const place_t *place, const scene_t *scene) {
}

#define EFFECT_PARAMETERS , global real *restrict transmittance, global real *restrict reflectance, global real *restrict reflected_st
#define EFFECT_ARGUMENTS , transmittance, reflectance, reflected_st
static inline void store_effects(const ray_t *ray, int first EFFECT_PARAMETERS) {
  scatter(ray->transmittance, transmittance + first, 1);
  scatter(ray->reflectance, reflectance + first, 1);
  scatter(ray->reflected_s, reflected_st + 2 * first, 2);
  scatter(ray->reflected_t, reflected_st + 2 * first + 1, 2);
}

// ... layer.cl
// ... layer_single.cl
// ... parks_never.cl
// ... steps_uncounted.cl
// ... trace.cl
