// footprint_exact.cl: how a direction bent by Snell's law changes with the ray and the normal.
//
// provides  footprint_bent()        needs  prelude
// source    Igehy, Tracing Ray Differentials, SIGGRAPH 1999, sec. 3.1.3. With n unit and against d, c = -d.n and k the
//           cosine behind: t = eta d + m n, m = eta c - k = -(1 - eta)(1 + eta) / (eta c + k), and from
//           k^2 = 1 - eta^2 + eta^2 c^2 the change of m is -eta m / k times that of c

static inline real3v footprint_bent(real3v d, real3v t, real3v n, realv eta, real3v d_change, real3v n_change) {
  const realv c = -dot3(d, n), k = -dot3(t, n);
  const realv m = -((realv)1 - eta) * ((realv)1 + eta) / (eta * c + k);
  const realv c_change = -(dot3(d_change, n) + dot3(d, n_change));
  const realv m_change = -eta * m * c_change / k;
  const real3v t_change = {eta * d_change.x + m * n_change.x + m_change * n.x,
                           eta * d_change.y + m * n_change.y + m_change * n.y,
                           eta * d_change.z + m * n_change.z + m_change * n.z};
  return t_change;
}
