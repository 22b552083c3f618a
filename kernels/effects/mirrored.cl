// mirrored.cl: the law of reflection.
//
// provides  mirrored()        needs  prelude
// used by   the effects that reflect; a kernel without any has no text of it

// The direction with its part along the normal turned round; a normal of either side, of any length that can be squared.
static inline real3v mirrored(real3v direction, real3v normal) {
  const realv twice = (realv)-2 * dot3(direction, normal) / dot3(normal, normal);
  return at3(direction, normal, twice);
}
