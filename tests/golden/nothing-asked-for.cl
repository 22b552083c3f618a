// lenses   sphere
// rays     point
// method   polynomial finds every crossing of a polynomial, by proof; a ray whose proof rounding forbids is undecided
// snell    exact
// effects  none
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
  real r;                 // radius
} sphere_t;

typedef struct {
  film_t film;
  source_t source;
  picture_t picture;
  method_t method;
  real n_medium;          // index around the lenses
  lens_t lens_0;
  sphere_t shape_0;
} scene_t;

// ... ray.cl
// ... film.cl
// ... rays_point.cl
// ... placement.cl
// ... search.cl
#line 1 "generated"
// a surface, from its expression

// sphere: x^2 + y^2 + z^2 - r^2; negative inside
#define sphere_DEGREE 2
#define sphere_ROUNDINGS (18 + INPUT_ROUNDINGS * 14)
static inline void sphere_along(real3v o, real3v d, sphere_t shape, realv c[3]) {
  c[0] = o.x * o.x + o.y * o.y + o.z * o.z - shape.r * shape.r;
  c[1] = 2.0 * o.x * d.x + 2.0 * o.y * d.y + 2.0 * o.z * d.z;
  c[2] = d.x * d.x + d.y * d.y + d.z * d.z;
}

static inline realv sphere_magnitude(real3v p, sphere_t shape) {
  const real r2 = shape.r * shape.r;   // r^2
  const real size1 = r2 < 0.0 ? -r2 : r2;   // abs(r^2)
  return p.x * p.x + p.y * p.y + p.z * p.z + size1;
}

#define SURFACE(name) sphere_##name

// ... polynomial_ray.cl
// ... search_quadratic.cl
// ... root_isolated.cl
// ... ahead_box.cl
// ... ahead_chord.cl
// ... lens.cl
// ... total_impossible.cl
// ... snell_exact.cl
// ... screen.cl
// ... ends_map.cl
#line 1 "generated"
// what this scene consists of

static inline void start(ray_t *ray, const scene_t *scene) {
  lens_0_start(ray, &scene->lens_0, scene->shape_0);
}

static inline void meet_lenses(const ray_t *ray, const scene_t *scene, hit_t *hit) {
  lens_0_meet(ray, &scene->lens_0, scene->shape_0, &scene->method, hit);
}

static inline void at_interface(ray_t *ray, const interface_t *at, const scene_t *scene) {
}

static inline void at_picture(ray_t *ray, const place_t *place, const scene_t *scene) {
}

#define EFFECT_PARAMETERS
#define EFFECT_ARGUMENTS
static inline void store_effects(const ray_t *ray, int first EFFECT_PARAMETERS) {
}

// ... layer.cl
// ... layer_single.cl
// ... parks_never.cl
// ... steps_uncounted.cl
// ... trace.cl
