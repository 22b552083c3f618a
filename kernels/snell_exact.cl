// snell_exact.cl: bend unit directions at a smooth interface by Snell's law.
//
// provides  refract()        needs  prelude, cosine_behind()
// source    Born & Wolf, Principles of Optics, 7th ed., sec. 3.2.2; written for a normal g of any length, with
//           c = -d.g and s2 = |g x d|^2: |g|^2 times the squared cosine behind the surface is
//           k = c^2 + (1 - eta)(1 + eta) s2, and the part along g is -(1 - eta)(1 + eta) / (eta c + sqrt(k)). Nothing
//           cancels before eta^2 multiplies it, no length of g is needed, and the new direction is as long as the old
//           one: neither its rounding nor the old one's grows by more than eta.
//           At eta = 1 the direction is returned bit for bit.

// Returns the unit direction behind the interface; lanes set in *total are totally reflected and keep theirs.
//
//   d    unit, along the ray        g      against it, of any length
//   eta  n_before / n_after, > 0    total  out; never set where eta <= 1
static inline real3v refract(real3v d, real3v g, realv eta, maskv *total) {
  // Take the cosine behind the surface from its square. Rounding must not turn the normal
  const realv c = max_v(-dot3(d, g), (realv)0);
  const real3v across = cross3(g, d);
  const realv excess = ((realv)1 - eta) * ((realv)1 + eta);
  const realv behind = cosine_behind(c * c + excess * dot3(across, across), total);

  // Scale the tangential part and restore unit length along the normal; the root is no number where nothing is refracted
  const realv denominator = eta * c + behind;
  const realv along = denominator > (realv)0 ? excess / denominator : (realv)0;
  const real3v t = {eta * d.x - along * g.x, eta * d.y - along * g.y, eta * d.z - along * g.z};
  return pick3(*total, d, t);
}
