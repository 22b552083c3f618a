// snell_exact.cl: bend unit directions at a smooth interface by Snell's law.
//
// provides  refract()        needs  prelude
// source    Born & Wolf, Principles of Optics, 7th ed., sec. 3.2.2; written for a normal g of any length, q = g.g and
//           c = -d.g: q times the squared cosine behind the surface, 1 - eta^2 (1 - c^2 / q), is
//           k = eta^2 c^2 + (1 - eta)(1 + eta) q, and the part along g, (eta c - sqrt(k)) / q, is
//           -(1 - eta)(1 + eta) / (eta c + sqrt(k)), in which nothing cancels and no length of g is needed.
//           At eta = 1 the direction is returned bit for bit.

// Returns the unit direction behind the interface; lanes set in *total are totally reflected and keep theirs.
//
//   d    unit, along the ray        g      against it, of any length
//   eta  n_before / n_after, > 0    total  out; never set where eta <= 1
static inline real3v refract(real3v d, real3v g, realv eta, maskv *total) {
  // Square the cosine behind the surface; below zero there is no refracted ray. Rounding must not turn the normal
  const realv ec = eta * max_v(-dot3(d, g), (realv)0);
  const realv excess = ((realv)1 - eta) * ((realv)1 + eta);
  const realv k = ec * ec + excess * dot3(g, g);
  *total = k < (realv)0;

  // Scale the tangential part and restore unit length along the normal; the root is no number where nothing is refracted
  const realv denominator = ec + sqrt(k);
  const realv along = denominator > (realv)0 ? excess / denominator : (realv)0;
  const real3v t = {eta * d.x - along * g.x, eta * d.y - along * g.y, eta * d.z - along * g.z};
  return pick3(*total, d, t);
}
