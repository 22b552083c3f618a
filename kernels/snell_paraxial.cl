// snell_paraxial.cl: the cheap rule: tangents bend as if they were sines. Right only near the axis.
//
// provides  refract()        needs  prelude
// source    the small-angle form of Snell's law; with d = p + u, p along the normal: p + eta u, made unit again.
//           40 degrees inside glass of 1.458 leave at 50.7 degrees, not 69.5.

// Returns the unit direction behind the interface. No lane is ever totally reflected.
//
//   d    unit, along the ray        g      against it, of any length
//   eta  n_before / n_after, > 0    total  out, none
static inline real3v refract(real3v d, real3v g, realv eta, maskv *total) {
  const real3v n = unit3(g);
  const realv dn = dot3(d, n);
  const realv grows = ((realv)1 - eta) * dn;  // eta d + (1 - eta) (d.n) n is p + eta u
  const real3v bent = {eta * d.x + grows * n.x, eta * d.y + grows * n.y, eta * d.z + grows * n.z};
  const realv length = sqrt(dot3(bent, bent));
  const maskv bends = (eta != (realv)1) & (length > (realv)0);
  const real3v unit = {bent.x / length, bent.y / length, bent.z / length};
  *total = (maskv)0;
  return pick3(bends, unit, d);
}
