// total_impossible.cl: no surface reflects totally, as is proved of the scene: only rounding may say so.
//
// provides  cosine_behind()        needs  prelude

// The cosine of refraction from its square, both times powers of the normal's length.
static inline realv cosine_behind(realv square, maskv *total) {
  *total = (maskv)0;
  return sqrt(max_v(square, (realv)0));
}
