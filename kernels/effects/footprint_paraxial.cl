// footprint_paraxial.cl: how a direction bent by the paraxial rule changes with the ray and the normal.
//
// provides  footprint_bent()        needs  prelude
// source    the rule of snell_paraxial.cl: t is b = eta d + (1 - eta) (d.n) n, made unit

static inline real3v footprint_bent(real3v d, real3v t, real3v n, realv eta, real3v d_change, real3v n_change) {
  const realv dn = dot3(d, n), dn_change = dot3(d_change, n) + dot3(d, n_change);
  const realv rest = (realv)1 - eta;
  const real3v b = {eta * d.x + rest * dn * n.x, eta * d.y + rest * dn * n.y, eta * d.z + rest * dn * n.z};
  const real3v b_change = {eta * d_change.x + rest * (dn_change * n.x + dn * n_change.x),
                           eta * d_change.y + rest * (dn_change * n.y + dn * n_change.y),
                           eta * d_change.z + rest * (dn_change * n.z + dn * n_change.z)};
  const realv shrink = (realv)1 / sqrt(dot3(b, b));
  const real3v across = at3(b_change, t, -dot3(t, b_change));
  const real3v t_change = {shrink * across.x, shrink * across.y, shrink * across.z};
  return t_change;
}
