// snell_exact.cl: bend unit directions at a smooth interface by Snell's law.
//
// provides  refract()        needs  prelude
// source    Born & Wolf, Principles of Optics, 7th ed., sec. 3.2.2; written so that nothing cancels: with c = cos of
//           incidence and s = its sine, the squared cosine behind the surface, 1 - eta^2 s^2, is
//           c^2 + (1 - eta)(1 + eta) s^2, and eta c - sqrt(k) is -(1 - eta)(1 + eta) / (eta c + sqrt(k)).
//           At eta = 1 the direction is returned bit for bit.

// Returns the unit direction behind the interface; lanes set in *total are totally reflected and keep theirs.
//
//   d    unit, along the ray        n      unit, against it
//   eta  n_before / n_after, > 0    total  out; never set where eta <= 1
static inline real3v refract(real3v d, real3v n, realv eta, maskv *total) {
  // Split the direction by the normal; rounding must not turn it to the wrong side
  const realv dn = dot3(d, n);
  const realv c = max_v(-dn, (realv)0);
  const real3v tangential = at3(d, n, -dn);
  const realv s2 = dot3(tangential, tangential);

  // Square the cosine behind the surface; below zero there is no refracted ray
  const realv excess = ((realv)1 - eta) * ((realv)1 + eta);
  const realv k = c * c + excess * s2;
  *total = k < (realv)0;

  // Scale the tangential part and restore unit length along the normal
  const realv denominator = eta * c + sqrt(max_v(k, (realv)0));
  const realv along = denominator > (realv)0 ? excess / denominator : (realv)0;
  const real3v t = {eta * d.x - along * n.x, eta * d.y - along * n.y, eta * d.z - along * n.z};
  return pick3(*total, d, t);
}
