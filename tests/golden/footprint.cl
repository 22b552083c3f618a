// lenses   torus, ball
// rays     point
// method   polynomial finds every crossing of a polynomial, by proof; a ray whose proof rounding forbids is undecided
// snell    exact
// effects  follow_total_reflection, footprint
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
#define RAY_WORDS 27
#define RAY_CARRIES realv point_x_by_row; realv point_y_by_row; realv point_z_by_row; realv turn_x_by_row; realv turn_y_by_row; realv turn_z_by_row; realv point_x_by_column; realv point_y_by_column; realv point_z_by_column; realv turn_x_by_column; realv turn_y_by_column; realv turn_z_by_column; realv s_by_row; realv s_by_column; realv t_by_row; realv t_by_column;

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
  real R;                 // radius of the ring
  real r;                 // radius of the tube
} torus_t;

typedef struct {
  real diameter;          // of the ball
} ball_t;

typedef struct {
  film_t film;
  source_t source;
  picture_t picture;
  method_t method;
  real n_medium;          // index around the lenses
  lens_t lens_0;
  torus_t shape_0;
  lens_t lens_1;
  ball_t shape_1;
} scene_t;

// ... ray.cl
// ... film.cl
// ... rays_point.cl
// ... placement.cl
// ... hessian.cl
// ... search.cl
#line 1 "generated"
// a surface, from its expression

// torus: (R - sqrt(x^2 + y^2))^2 + z^2 - r^2; negative inside
#define torus_DEGREE 4
#define torus_ROUNDINGS (48 + INPUT_ROUNDINGS * 40)
static inline void torus_along(real3v o, real3v d, torus_t shape, realv c[5]) {
  const real R2 = shape.R * shape.R;   // R^2
  const realv difference1 = o.z * o.z - shape.r * shape.r;   // oz^2 - r^2
  const realv sum1 = o.x * o.x + o.y * o.y - R2 + difference1;   // ox^2 + oy^2 - R^2 + (oz^2 - r^2)
  const real product1 = 4.0 * R2;   // 4 * R^2
  const realv product2 = 2.0 * sum1;   // 2 * (ox^2 + oy^2 - R^2 + (oz^2 - r^2))
  const realv sum2 = 2.0 * o.x * d.x + 2.0 * o.y * d.y + 2.0 * o.z * d.z;   // 2 * ox * dx + 2 * oy * dy + 2 * oz * dz
  const realv dz2 = d.z * d.z;   // dz^2
  const realv sum3 = d.x * d.x + d.y * d.y + dz2;   // dx^2 + dy^2 + dz^2
  c[0] = sum1 * sum1 + product1 * difference1;
  c[1] = product2 * sum2 + 8.0 * R2 * (o.z * d.z);
  c[2] = product2 * sum3 + sum2 * sum2 + product1 * dz2;
  c[3] = 2.0 * sum2 * sum3;
  c[4] = sum3 * sum3;
}

static inline realv torus_magnitude(real3v p, torus_t shape) {
  const real R2 = shape.R * shape.R;   // R^2
  const real size1 = R2 < 0.0 ? -R2 : R2;   // abs(R^2)
  const real r2 = shape.r * shape.r;   // r^2
  const real size2 = r2 < 0.0 ? -r2 : r2;   // abs(r^2)
  const realv sum1 = p.z * p.z + size2;   // z^2 + abs(r^2)
  const realv sum2 = p.x * p.x + p.y * p.y + size1 + sum1;   // x^2 + y^2 + abs(R^2) + (z^2 + abs(r^2))
  const real product1 = 4.0 * R2;   // 4 * R^2
  const real size3 = product1 < 0.0 ? -product1 : product1;   // abs(4 * R^2)
  return sum2 * sum2 + size3 * sum1;
}

#define SURFACE(name) torus_##name

// ... polynomial_ray.cl
// ... polynomial_bounds.cl
// ... polynomial_walk.cl
// ... search_polynomial.cl
#line 1 "generated"
// what effects ask of the surface

// torus: (R - sqrt(x^2 + y^2))^2 + z^2 - r^2; negative inside
static inline void torus_hessian(real3v p, torus_t shape, real3v *g, realv h[6]) {
  const realv x2 = p.x * p.x;   // x^2
  const realv y2 = p.y * p.y;   // y^2
  const real R2 = shape.R * shape.R;   // R^2
  const realv z2 = p.z * p.z;   // z^2
  const real r2 = shape.r * shape.r;   // r^2
  const realv difference1 = z2 - r2;   // z^2 - r^2
  const realv sum1 = x2 + y2 - R2 + difference1;   // x^2 + y^2 - R^2 + (z^2 - r^2)
  const realv sum2 = sum1 * sum1 + 4.0 * R2 * difference1;   // (x^2 + y^2 - R^2 + (z^2 - r^2))^2 + 4 * R^2 * (z^2 - r^2)
  const real sum3 = R2 + r2;   // R^2 + r^2
  const realv product1 = sum3 * (sum1 + 2.0 * R2);   // (R^2 + r^2) * (x^2 + y^2 - R^2 + (z^2 - r^2) + 2 * R^2)
  const realv product2 = 4.0 * sum1;   // 4 * (x^2 + y^2 - R^2 + (z^2 - r^2))
  const real product3 = 2.0 * sum3;   // 2 * (R^2 + r^2)
  const real product4 = 8.0 * R2;   // 8 * R^2
  const realv product5 = 8.0 * p.z;   // 8 * z
  g->x = sum2 < product1 ? product2 * p.x : product3 * p.x;
  g->y = sum2 < product1 ? product2 * p.y : product3 * p.y;
  g->z = sum2 < product1 ? product2 * p.z + product4 * p.z : product3 * p.z;
  h[0] = sum2 < product1 ? 8.0 * x2 + product2 : (realv)product3;
  h[1] = sum2 < product1 ? 8.0 * p.y * p.x : (realv)0.0;
  h[2] = sum2 < product1 ? product5 * p.x : (realv)0.0;
  h[3] = sum2 < product1 ? 8.0 * y2 + product2 : (realv)product3;
  h[4] = sum2 < product1 ? product5 * p.y : (realv)0.0;
  h[5] = sum2 < product1 ? 8.0 * z2 + product2 + product4 : (realv)product3;
}

#define torus_CONVEX 0
#define torus_TOLERANCE (realv)0

#define SURFACE(name) torus_##name

// ... root_corrected.cl
// ... ahead_box.cl
#line 1 "generated"
// a surface, from its expression

// ball: x^2 + y^2 + z^2 - diameter^2/4; negative inside
#define ball_DEGREE 2
#define ball_ROUNDINGS (18 + INPUT_ROUNDINGS * 14)
static inline void ball_along(real3v o, real3v d, ball_t shape, realv c[3]) {
  const real product1 = 0.5 * shape.diameter;   // 0.5 * diameter
  c[0] = o.x * o.x + o.y * o.y + o.z * o.z - product1 * product1;
  c[1] = 2.0 * o.x * d.x + 2.0 * o.y * d.y + 2.0 * o.z * d.z;
  c[2] = d.x * d.x + d.y * d.y + d.z * d.z;
}

static inline realv ball_magnitude(real3v p, ball_t shape) {
  const real product1 = 0.5 * shape.diameter;   // 0.5 * diameter
  const real product1_squared = product1 * product1;   // (0.5 * diameter)^2
  const real size1 = product1_squared < 0.0 ? -product1_squared : product1_squared;   // abs((0.5 * diameter)^2)
  return p.x * p.x + p.y * p.y + p.z * p.z + size1;
}

#define SURFACE(name) ball_##name

// ... polynomial_ray.cl
// ... search_quadratic.cl
#line 1 "generated"
// what effects ask of the surface

// ball: x^2 + y^2 + z^2 - diameter^2/4; negative inside
static inline void ball_hessian(real3v p, ball_t shape, real3v *g, realv h[6]) {
  g->x = 2.0 * p.x;
  g->y = 2.0 * p.y;
  g->z = 2.0 * p.z;
  h[0] = (realv)2.0;
  h[1] = (realv)0.0;
  h[2] = (realv)0.0;
  h[3] = (realv)2.0;
  h[4] = (realv)0.0;
  h[5] = (realv)2.0;
}

#define ball_CONVEX 1
#define ball_TOLERANCE (realv)0

#define SURFACE(name) ball_##name

// ... root_isolated.cl
// ... ahead_box.cl
// ... ahead_chord.cl
// ... lens.cl
// ... lens_hessian.cl
// ... lens.cl
// ... lens_hessian.cl
// ... total_possible.cl
// ... snell_exact.cl
// ... screen.cl
// ... ends_map.cl
#line 1 "generated"
// functions of a packet's surfaces

static inline void at_lens_hessian(const scene_t *scene, maskv lens, hessian_t *asked) {
  const maskv is_0 = lens == (maskv)0;
  if (any_lane(is_0)) lens_0_hessian(&scene->lens_0, scene->shape_0, is_0, asked);
  const maskv is_1 = lens == (maskv)1;
  if (any_lane(is_1)) lens_1_hessian(&scene->lens_1, scene->shape_1, is_1, asked);
}

// ... effects/mirrored.cl
// ... effects/follow_total_reflection.cl
// ... effects/footprint_point.cl
// ... effects/footprint_exact.cl
// ... effects/footprint.cl
#line 1 "generated"
// what this scene consists of

static inline void start(ray_t *ray, const scene_t *scene) {
  lens_0_start(ray, &scene->lens_0, scene->shape_0);
  lens_1_start(ray, &scene->lens_1, scene->shape_1);
  footprint_start(ray, scene);
}

static inline void meet_lenses(const ray_t *ray, const scene_t *scene, hit_t *hit) {
  lens_0_meet(ray, &scene->lens_0, scene->shape_0, &scene->method, hit);
  lens_1_meet(ray, &scene->lens_1, scene->shape_1, &scene->method, hit);
}

static inline void at_interface(ray_t *ray, const interface_t *at, const scene_t *scene) {
  follow_total_reflection_interface(ray, at, scene);
  footprint_interface(ray, at, scene);
}

static inline void at_picture(ray_t *ray, const place_t *place, const scene_t *scene) {
  footprint_landing(ray, place, scene);
}

#define EFFECT_PARAMETERS , global real *restrict jacobian
#define EFFECT_ARGUMENTS , jacobian
static inline void store_effects(const ray_t *ray, int first EFFECT_PARAMETERS) {
  scatter(ray->s_by_row, jacobian + 4 * first, 4);
  scatter(ray->s_by_column, jacobian + 4 * first + 1, 4);
  scatter(ray->t_by_row, jacobian + 4 * first + 2, 4);
  scatter(ray->t_by_column, jacobian + 4 * first + 3, 4);
}

// ... layer.cl
// ... layer_single.cl
// ... parks_never.cl
// ... steps_uncounted.cl
// ... trace.cl
