// placement.cl: between the world and a lens's own space.
//
// provides  to_local_point(), to_local_vector(), to_world_point(), to_world_normal(), span_t, span_in_box()
// needs     prelude; lens_t { to_local[9], to_world[9] row by row, centre[3], box_low[3], box_high[3] }
//
// The map is affine, so the parameter t of a ray is the same on both sides and roots need no conversion.

static inline real3v turn3(const real *m, real3v v) {
  const real3v w = {m[0] * v.x + m[1] * v.y + m[2] * v.z,   //
                    m[3] * v.x + m[4] * v.y + m[5] * v.z,   //
                    m[6] * v.x + m[7] * v.y + m[8] * v.z};
  return w;
}

static inline real3v to_local_point(const lens_t *lens, real3v p) {
  return turn3(lens->to_local, at3(p, broadcast3(lens->centre), (realv)-1));
}

static inline real3v to_local_vector(const lens_t *lens, real3v v) { return turn3(lens->to_local, v); }

static inline real3v to_world_point(const lens_t *lens, real3v p) {
  return at3(turn3(lens->to_world, p), broadcast3(lens->centre), (realv)1);
}

// A gradient goes back by the transpose of the map to local space; not unit.
static inline real3v to_world_normal(const lens_t *lens, real3v g) {
  const real *m = lens->to_local;
  const real3v n = {m[0] * g.x + m[3] * g.y + m[6] * g.z,   //
                    m[1] * g.x + m[4] * g.y + m[7] * g.z,   //
                    m[2] * g.x + m[5] * g.y + m[8] * g.z};
  return n;
}

// The stretch of a ray that can meet the solid; empty unless enter < leave.
typedef struct {
  realv enter, leave;
} span_t;

// A ray along the slab has an infinite inverse: both ends lie at infinity, on two sides of it inside the slab and on one
// outside. On a face of it 0 / 0 limits nothing, which does no harm: the solid does not reach the face.
static inline void clip_to_slab(realv o, realv d, real low, real high, span_t *span) {
  const realv inverse = (realv)1 / d;
  const realv a = ((realv)low - o) * inverse;
  const realv b = ((realv)high - o) * inverse;
  span->enter = max_v(span->enter, min_v(a, b));
  span->leave = min_v(span->leave, max_v(a, b));
}

// Clip the ray ahead of its origin to the lens's bounding box.
//
// Each end is off by up to 3.5 roundings, which may turn round the ends of a box that is thinner than that: so it is made
// longer by 4 at either end.
static inline span_t span_in_box(const lens_t *lens, real3v o, real3v d) {
  span_t span = {(realv)0, (realv)REAL_MAX};
  clip_to_slab(o.x, d.x, lens->box_low[0], lens->box_high[0], &span);
  clip_to_slab(o.y, d.y, lens->box_low[1], lens->box_high[1], &span);
  clip_to_slab(o.z, d.z, lens->box_low[2], lens->box_high[2], &span);
  span.enter = span.enter * (realv)((real)1 - 2 * (real)REAL_EPSILON);
  span.leave = min_v(span.leave * (realv)((real)1 + 2 * (real)REAL_EPSILON), (realv)REAL_MAX);
  return span;
}
