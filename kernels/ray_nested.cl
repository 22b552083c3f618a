// ray_nested.cl: ray.cl where solids may touch or overlap: a ray travels in a set of solids at a time.
//
// provides  ray_t, hit_t, interface_t, NOWHERE; new_ray(), end_ray(), longest()
// needs     prelude; generated: RAY_* status numbers, and what a ray carries for the effects, RAY_CARRIES
// set by    the generated head: CONTACT_IS_DECIDED, whether the precision tells contact from a gap; SOLIDS, what is known
//           of the lenses of a set beside it
//
// A set of lenses is a mask of bits, one a lens, in the order of priority: the highest bit of the solids that a point lies
// in is that of the medium there (Schmidt & Budge, Simple nested dielectrics in ray traced images, JGT 7(2), 2002).

#define NOWHERE ((maskv)-1)  // in place of a lens number: around all lenses

typedef struct {
  real3v origin;     // world: the source, or the last surface point
  real3v direction;  // world, unit
  maskv inside;      // set of the lenses whose solids the ray travels in
  maskv on;          // set of the lenses on whose surfaces the origin lies
  maskv events;      // surfaces met so far between unlike media
  maskv status;      // RAY_*, once the ray is no longer alive
  maskv alive;       // lanes still travelling
  realv passed;      // length from the last event, or the start, to the origin: surfaces within one medium lie between
  SOLIDS
  RAY_CARRIES
} ray_t;

// The nearest surfaces ahead: one, or those that lie within rounding of each other.
typedef struct {
  realv t;          // distance of the nearest from the ray's origin, scene units
  realv low, high;  // between which all of them lie, whatever rounding has done
  realv error;      // how far along the ray the nearest may be from where it is met, by rounding there
  real3v point;     // world, on the nearest
  real3v normal;    // world, of the nearest, against the ray, of any length that can be squared
  maskv lens;       // number of the nearest
  realv n_lens, eta; // of lens.cl, of which only the normal serves here
  maskv crossed;    // set of the lenses whose surfaces these are
  maskv found;      // lanes that meet a surface
  maskv searches;   // of a lens, that this took
  maskv steps;      // that they took
  realv doubt;      // distance up to which the searches are proved; REAL_MAX where all of them are
  SOLIDS
} hit_t;

// A surface between two media being met: what effects may read. The ray itself is already bent.
typedef struct {
  real3v incident;         // world, unit: the ray's direction before
  real3v normal;           // world, against the incident ray, of any length that can be squared
  realv length;            // from the event before, or the ray's start, scene units
  realv n_before, n_after; // indices on the incident side and behind the surface
  maskv lens;              // number of the lens whose surface it is
  maskv before, after;     // numbers of the lenses that are the media there, or NOWHERE
  maskv leaves;            // lanes whose medium before is that of a lens
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
  ray.passed = (realv)0;
  return ray;
}

static inline void end_ray(ray_t *ray, maskv lanes, int status) {
  ray->status = lanes ? (maskv)status : ray->status;
  ray->alive = ray->alive & not_lane(lanes);
}

// The largest of a vector's parts.
static inline realv longest(real3v v) { return max_v(abs_v(v.x), max_v(abs_v(v.y), abs_v(v.z))); }
