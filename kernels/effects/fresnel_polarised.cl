// fresnel_polarised.cl: the share of light that is refracted, where what one surface does to s and p the next one meets.
//
// provides  fresnel_polarised_start(), fresnel_polarised_interface()        needs  prelude, ray
// carries   transmittance, polarised_q, polarised_u, polarised_v: the Stokes parameters of light that starts unpolarised;
//           across_x, across_y, across_z: the unit vector across the ray from which Q and U are counted, 0 while any will do
// source    Born & Wolf, Principles of Optics, 7th ed., sec. 1.5: a field E has the parts E_s along s and E_p along d x s
//           on every ray d. Refraction lets both pass by real, positive amplitudes; total reflection moves the phase of s
//           before that of p by delta, tan(delta / 2) = cos sqrt(sin^2 - (n_after / n_before)^2) / sin^2 (eq. 61)
//
// Q = |E_s|^2 - |E_p|^2 and U + i V = 2 E_s conj(E_p): turning the axes by an angle turns (Q, U) by twice that.

static inline void fresnel_polarised_start(ray_t *ray, const scene_t *scene) {
  ray->transmittance = (realv)1;
  ray->polarised_q = ray->polarised_u = ray->polarised_v = (realv)0;
  ray->across_x = ray->across_y = ray->across_z = (realv)0;
}

static inline void fresnel_polarised_interface(ray_t *ray, const interface_t *at, const scene_t *scene) {
  const maskv lanes = at->lanes & ray->alive;
  const maskv total = lanes & at->total, refracted = lanes & not_lane(at->total);

  // Turn the axes so that one lies along s, across the plane of incidence; straight on, they stay
  const real3v old = {ray->across_x, ray->across_y, ray->across_z};
  const real3v s = cross3(at->incident, at->normal);
  const realv across = dot3(s, s);
  const maskv turns = lanes & (across > (realv)0);
  const realv scale = (realv)1 / sqrt(turns ? across : (realv)1);
  const realv c = dot3(old, s), w = dot3(cross3(at->incident, old), s);
  const realv square = c * c + w * w;
  const maskv known = turns & (square > (realv)0);
  const realv inverse = (realv)1 / (known ? square : (realv)1);
  const realv cos_twice = known ? (c * c - w * w) * inverse : (realv)1;
  const realv sin_twice = known ? (realv)2 * c * w * inverse : (realv)0;
  const realv q = ray->polarised_q * cos_twice + ray->polarised_u * sin_twice;
  const realv u = ray->polarised_u * cos_twice - ray->polarised_q * sin_twice;
  const realv v = ray->polarised_v;
  ray->across_x = turns ? scale * s.x : old.x;
  ray->across_y = turns ? scale * s.y : old.y;
  ray->across_z = turns ? scale * s.z : old.z;

  // Refraction weakens s and p each by its own share
  const realv before = max_v(-dot3(at->incident, at->normal), (realv)0);
  const realv behind = max_v(-dot3(ray->direction, at->normal), (realv)0);
  const realv sum_s = at->n_before * before + at->n_after * behind;
  const realv sum_p = at->n_after * before + at->n_before * behind;
  const realv product = (realv)4 * at->n_before * before * at->n_after * behind;
  const maskv passes = product > (realv)0;
  const realv share_s = passes ? product / (sum_s * sum_s) : (realv)0;
  const realv share_p = passes ? product / (sum_p * sum_p) : (realv)0;
  const realv in_s = (realv)NUMBER(0.5) * (ray->transmittance + q) * share_s;
  const realv in_p = (realv)NUMBER(0.5) * (ray->transmittance - q) * share_p;
  const realv both = sqrt(share_s * share_p);

  // Total reflection turns U into V
  const realv ratio = at->n_after / at->n_before;
  const realv beyond = across - ratio * ratio * (across + before * before);
  const realv tangent = total ? before * sqrt(max_v(beyond, (realv)0)) / across : (realv)0;
  const realv whole = (realv)1 / ((realv)1 + tangent * tangent);
  const realv cosine = ((realv)1 - tangent * tangent) * whole, sine = (realv)2 * tangent * whole;

  ray->transmittance = refracted ? in_s + in_p : ray->transmittance;
  ray->polarised_q = refracted ? in_s - in_p : q;
  ray->polarised_u = refracted ? both * u : cosine * u - sine * v;
  ray->polarised_v = refracted ? both * v : sine * u + cosine * v;
}
