// picture_open.cl: a picture that stops no light: rays meet its plane when they have left all lenses.
//
// provides  picture_met()        needs  prelude, ray_nested; picture_t
static inline maskv picture_met(const ray_t *ray, maskv travels, hit_t *hit, const picture_t *picture) {
  return (maskv)0;
}
