// coats.cl: what tells on which faces of a solid a point lies: those that a mirror covers, or the others.
//
// provides  coat_t, coat_reach(), coat_spread()        needs  prelude, placement

#define COAT_PLACED ((realv)(16 * REAL_EPSILON))  // of the coordinates on the way to local space and along the ray

// At a point in the lens's own space: the largest of the coated faces' functions and of the others', with their
// gradients. All are negative inside the solid, and the larger one is 0 on its surface.
typedef struct {
  realv coat, rest;
  real3v coat_gradient, rest_gradient;
} coat_t;

static inline realv longest_part(real3v v) { return max_v(abs_v(v.x), max_v(abs_v(v.y), abs_v(v.z))); }

// By how much rounding may have moved each coordinate of a point in the world.
static inline realv coat_reach(const lens_t *lens, real3v point, realv length) {
  return COAT_PLACED * (longest_part(point) + longest_part(broadcast3(lens->centre)) + length);
}

// What a function of this gradient changes by at most where each coordinate of a point in the world does so by 1.
static inline realv coat_spread(const lens_t *lens, real3v gradient) {
  const real *m = lens->to_local;
  return (realv)(fabs(m[0]) + fabs(m[1]) + fabs(m[2])) * abs_v(gradient.x) +
         (realv)(fabs(m[3]) + fabs(m[4]) + fabs(m[5])) * abs_v(gradient.y) +
         (realv)(fabs(m[6]) + fabs(m[7]) + fabs(m[8])) * abs_v(gradient.z);
}
