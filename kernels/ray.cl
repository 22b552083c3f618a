// ray.cl: what is known of the rays of a packet while they travel, and of what they meet.
//
// provides  ray_t, hit_t, interface_t, NOWHERE; new_ray(), end_ray()
// needs     prelude; generated: RAY_* status numbers, and what a ray carries for the effects, RAY_CARRIES

#define NOWHERE ((maskv)-1)  // in place of a lens number: in no solid, on no surface

typedef struct {
  real3v origin;     // world: the source, or the last surface point
  real3v direction;  // world, unit
  maskv inside;      // number of the lens whose solid the ray travels in, or NOWHERE
  maskv on;          // number of the lens on whose surface the origin lies, or NOWHERE
  maskv events;      // surfaces met so far
  maskv status;      // RAY_*, once the ray is no longer alive
  maskv alive;       // lanes still travelling
  RAY_CARRIES
} ray_t;

// The nearest surface ahead.
typedef struct {
  realv t;          // distance from the ray's origin, scene units
  real3v point;     // world
  real3v normal;    // world, outward, of any length that can be squared
  realv n_lens;     // index of the lens met
  realv eta;        // n_before / n_after there
  maskv lens;       // its number
  maskv found;      // lanes that meet a surface
  maskv searches;   // of a lens, that this took
  maskv steps;      // that they took
  realv doubt;      // distance up to which the searches are proved; REAL_MAX where all of them are
} hit_t;

// A surface being met: what effects may read. The ray itself is already bent.
typedef struct {
  real3v incident;         // world, unit: the ray's direction before
  real3v normal;           // world, against the incident ray, of any length that can be squared
  realv length;            // from the surface before, or the ray's start, scene units
  realv n_before, n_after; // indices on the incident side and behind the surface
  maskv lens;              // number of the lens
  maskv leaves;            // lanes that meet it from within
  maskv lanes;             // lanes that meet a surface now
  maskv total;             // those of them that are totally reflected
} interface_t;

static inline ray_t new_ray(real3v origin, real3v direction, maskv inside, maskv on, maskv alive) {
  ray_t ray;
  ray.origin = origin;
  ray.direction = direction;
  ray.inside = inside;
  ray.on = on;
  ray.events = (maskv)0;
  ray.status = (maskv)RAY_UNDECIDED;
  ray.alive = alive;
  return ray;
}

static inline void end_ray(ray_t *ray, maskv lanes, int status) {
  ray->status = lanes ? (maskv)status : ray->status;
  ray->alive = ray->alive & not_lane(lanes);
}
