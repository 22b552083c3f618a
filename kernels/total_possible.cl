// total_possible.cl: a surface may reflect totally.
//
// provides  cosine_behind()        needs  prelude

// The cosine of refraction from its square, both times powers of the normal's length; no number where *total is set.
static inline realv cosine_behind(realv square, maskv *total) {
  *total = square < (realv)0;
  return sqrt(square);
}
