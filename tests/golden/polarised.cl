// lenses   biconvex
// rays     point
// method   interval finds every crossing, by proof; a ray whose proof rounding forbids is undecided
// snell    exact
// effects  follow_total_reflection, fresnel_polarised
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
#define RAY_WORDS 18
#define RAY_CARRIES realv transmittance; realv polarised_q; realv polarised_u; realv polarised_v; realv across_x; realv across_y; realv across_z;

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
  real R1;                // radius of the front
  real R2;                // radius of the back
  real thickness;         // from vertex to vertex
  real diameter;          // of the rim
} biconvex_t;

typedef struct {
  film_t film;
  source_t source;
  picture_t picture;
  method_t method;
  real n_medium;          // index around the lenses
  lens_t lens_0;
  biconvex_t shape_0;
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

// biconvex: max(sag(R1) - z - thickness/2, z - thickness/2 + sag(R2), hypot(x, y) - diameter/2); sag(R) = [...]; negative inside
typedef struct {
  quadratic_t part_0;
  linear_t part_1;
  quadratic_t part_2;
  linear_t part_3;
  quadratic_t part_4;
} biconvex_parts_t;

static inline biconvex_parts_t biconvex_parts(real3v origin, real3v along, real3v reach, real3v drift, biconvex_t shape) {
  const real quotient1 = 1.0 / shape.R1;   // 1 / R1
  const realv sum1 = origin.x * origin.x + origin.y * origin.y;   // origin_x^2 + origin_y^2
  const real product1 = 0.5 * shape.thickness;   // 0.5 * thickness
  const realv sum2 = origin.z + product1;   // origin_z + 0.5 * thickness
  const realv product2 = 2.0 * sum2;   // 2 * (origin_z + 0.5 * thickness)
  // 2 * origin_x * along_x + 2 * origin_y * along_y
  const realv sum3 = 2.0 * origin.x * along.x + 2.0 * origin.y * along.y;
  const realv product3 = 2.0 * along.z;   // 2 * along_z
  const realv sum4 = along.x * along.x + along.y * along.y;   // along_x^2 + along_y^2
  const realv sum5 = sum4 + along.z * along.z;   // along_x^2 + along_y^2 + along_z^2
  const realv product4 = (46.0 + 42.0 * INPUT_ROUNDINGS) * REAL_EPSILON;   // (46 + 42 * INPUT_ROUNDINGS) * REAL_EPSILON
  const real size1 = quotient1 < 0.0 ? -quotient1 : quotient1;   // abs(1 / R1)
  const realv sum6 = reach.x * reach.x + reach.y * reach.y;   // reach_x^2 + reach_y^2
  const real size2 = product1 < 0.0 ? -product1 : product1;   // abs(0.5 * thickness)
  const realv sum7 = reach.z + size2;   // reach_z + abs(0.5 * thickness)
  const realv product5 = 2.0 * sum7;   // 2 * (reach_z + abs(0.5 * thickness))
  const realv sum8 = 2.0 * reach.x * drift.x + 2.0 * reach.y * drift.y;   // 2 * reach_x * drift_x + 2 * reach_y * drift_y
  const realv product6 = 2.0 * drift.z;   // 2 * drift_z
  // product4 * (size1 * (sum6 + sum7^2) + product5)
  const realv product7 = product4 * (size1 * (sum6 + sum7 * sum7) + product5);
  const realv product8 = 14.0 * INPUT_ROUNDINGS;   // 14 * INPUT_ROUNDINGS
  const realv product9 = (16.0 + product8) * REAL_EPSILON;   // (16 + 14 * INPUT_ROUNDINGS) * REAL_EPSILON
  const real size3 = shape.R1 < 0.0 ? -shape.R1 : shape.R1;   // abs(R1)
  const real quotient2 = 1.0 / shape.R2;   // 1 / R2
  const realv difference1 = product1 - origin.z;   // 0.5 * thickness - origin_z
  const realv product10 = 2.0 * difference1;   // 2 * (0.5 * thickness - origin_z)
  const real size4 = quotient2 < 0.0 ? -quotient2 : quotient2;   // abs(1 / R2)
  const realv sum9 = size2 + reach.z;   // abs(0.5 * thickness) + reach_z
  const realv product11 = 2.0 * sum9;   // 2 * (abs(0.5 * thickness) + reach_z)
  // product4 * (size4 * (sum6 + sum9^2) + product11)
  const realv product12 = product4 * (size4 * (sum6 + sum9 * sum9) + product11);
  const real size5 = shape.R2 < 0.0 ? -shape.R2 : shape.R2;   // abs(R2)
  const real product13 = 0.5 * shape.diameter;   // 0.5 * diameter
  const real product13_squared = product13 * product13;   // (0.5 * diameter)^2
  const real size6 = product13_squared < 0.0 ? -product13_squared : product13_squared;   // abs((0.5 * diameter)^2)
  biconvex_parts_t parts;
  parts.part_0.c[0] = quotient1 * (sum1 + sum2 * sum2) - product2;
  parts.part_0.c[1] = quotient1 * (sum3 + product2 * along.z) - product3;
  parts.part_0.c[2] = quotient1 * sum5;
  parts.part_0.error = (product7 + (size1 * (sum8 + product5 * drift.z) + product6)) + UNDERFLOW;
  parts.part_1.c[0] = shape.R1 - sum2;
  parts.part_1.c[1] = -along.z;
  parts.part_1.error = (product9 * (size3 + sum7) + drift.z) + UNDERFLOW;
  parts.part_2.c[0] = quotient2 * (sum1 + difference1 * difference1) - product10;
  parts.part_2.c[1] = quotient2 * (sum3 - product10 * along.z) + product3;
  parts.part_2.c[2] = quotient2 * sum5;
  parts.part_2.error = (product12 + (size4 * (sum8 + product11 * drift.z) + product6)) + UNDERFLOW;
  parts.part_3.c[0] = shape.R2 - difference1;
  parts.part_3.c[1] = along.z;
  parts.part_3.error = (product9 * (size5 + sum9) + drift.z) + UNDERFLOW;
  parts.part_4.c[0] = sum1 - product13_squared;
  parts.part_4.c[1] = sum3;
  parts.part_4.c[2] = sum4;
  parts.part_4.error = ((18.0 + product8) * REAL_EPSILON * (sum6 + size6) + sum8) + UNDERFLOW;
  return parts;
}

#define biconvex_LEAVES 2
static inline realv biconvex_joined(const realv of_leaf[biconvex_LEAVES]) { return max_v(of_leaf[0], of_leaf[1]); }

static inline void biconvex_bands(const biconvex_parts_t *parts, biconvex_t shape, band_t of_leaf[biconvex_LEAVES]) {
  const band_t part_0 = band_of_quadratic(parts->part_0);
  const band_t part_1 = band_of_linear(parts->part_1);
  const band_t part_2 = band_of_quadratic(parts->part_2);
  const band_t part_3 = band_of_linear(parts->part_3);
  const band_t part_4 = band_of_quadratic(parts->part_4);
  const band_t least1 = band_min(part_0, part_1);   // min(part_0, part_1)
  const band_t least2 = band_min(part_2, part_3);   // min(part_2, part_3)
  const band_t greatest1 = band_max(least1, least2);   // max(min(part_0, part_1), min(part_2, part_3))
  const band_t product1 = band_multiply(band_exact((realv)0.5), band_exact((realv)shape.diameter));   // 0.5 * diameter
  of_leaf[0] = band_times_flat(greatest1, product1);
  of_leaf[1] = part_4;
}

static inline void biconvex_start_bands(const biconvex_parts_t *parts, biconvex_t shape, band_t of_leaf[biconvex_LEAVES]) {
  const band_t part_0 = start_of_quadratic(parts->part_0);
  const band_t part_1 = start_of_linear(parts->part_1);
  const band_t part_2 = start_of_quadratic(parts->part_2);
  const band_t part_3 = start_of_linear(parts->part_3);
  const band_t part_4 = start_of_quadratic(parts->part_4);
  const band_t least1 = band_min(part_0, part_1);   // min(part_0, part_1)
  const band_t least2 = band_min(part_2, part_3);   // min(part_2, part_3)
  const band_t greatest1 = band_max(least1, least2);   // max(min(part_0, part_1), min(part_2, part_3))
  const band_t product1 = band_multiply(band_exact((realv)0.5), band_exact((realv)shape.diameter));   // 0.5 * diameter
  of_leaf[0] = band_times_flat(greatest1, product1);
  of_leaf[1] = part_4;
}

static inline void biconvex_slope_bands(const biconvex_parts_t *parts, biconvex_t shape, band_t of_leaf[biconvex_LEAVES]) {
  const band_t part_0 = band_of_quadratic(parts->part_0);
  const band_t part_1 = band_of_linear(parts->part_1);
  const band_t part_2 = band_of_quadratic(parts->part_2);
  const band_t part_3 = band_of_linear(parts->part_3);
  const band_t part_0_slope = slope_of_quadratic(parts->part_0);
  const band_t part_1_slope = slope_of_linear(parts->part_1);
  const band_t part_2_slope = slope_of_quadratic(parts->part_2);
  const band_t part_3_slope = slope_of_linear(parts->part_3);
  const band_t part_4_slope = slope_of_quadratic(parts->part_4);
  const band_t least1 = band_min(part_0, part_1);   // min(part_0, part_1)
  const band_t least2 = band_min(part_2, part_3);   // min(part_2, part_3)
  // part_2 < part_3 ? part_2_slope : part_3_slope
  const band_t branch1 = band_where(part_2, part_3, part_2_slope, part_3_slope);
  // part_0 < part_1 ? part_0_slope : part_1_slope
  const band_t branch2 = band_where(part_0, part_1, part_0_slope, part_1_slope);
  const band_t product1 = band_multiply(band_exact((realv)0.5), band_exact((realv)shape.diameter));   // 0.5 * diameter
  of_leaf[0] = band_times_flat(band_where(least1, least2, branch1, branch2), product1);
  of_leaf[1] = part_4_slope;
}

#define SURFACE(name) biconvex_##name

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
// ... effects/fresnel_polarised.cl
#line 1 "generated"
// what this scene consists of

static inline void start(ray_t *ray, const scene_t *scene) {
  lens_0_start(ray, &scene->lens_0, scene->shape_0);
  fresnel_polarised_start(ray, scene);
}

static inline void meet_lenses(const ray_t *ray, const scene_t *scene, hit_t *hit) {
  lens_0_meet(ray, &scene->lens_0, scene->shape_0, &scene->method, hit);
}

static inline void at_interface(ray_t *ray, const interface_t *at, const scene_t *scene) {
  follow_total_reflection_interface(ray, at, scene);
  fresnel_polarised_interface(ray, at, scene);
}

static inline void at_picture(ray_t *ray, const place_t *place, const scene_t *scene) {
}

#define EFFECT_PARAMETERS , global real *restrict transmittance
#define EFFECT_ARGUMENTS , transmittance
static inline void store_effects(const ray_t *ray, int first EFFECT_PARAMETERS) {
  scatter(ray->transmittance, transmittance + first, 1);
}

// ... layer.cl
// ... layer_single.cl
// ... parks_never.cl
// ... steps_uncounted.cl
// ... trace.cl
