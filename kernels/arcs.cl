// arcs.cl: arc sine, cosine and tangent for packets.
//
// provides  asin_v(), acos_v(), atan_v()        needs  prelude
//
// Beyond -1 and 1 the root is NaN, and so are asin_v and acos_v. Near 1 and -1 nothing cancels: 1 - a and 1 + a are exact
// where they are small. asin(a) and acos(a) are angles of the point with legs a and sqrt(1 - a^2): a relative error of
// either leg is at most one of the angle. The angle itself is atan2's, of 6 ulp at most.
//
// A mixed kernel has these words in both precisions, each under its own name.

#undef asin_v
#undef acos_v
#undef atan_v
#define asin_v PASTE(asin_of_, REAL)
#define acos_v PASTE(acos_of_, REAL)
#define atan_v PASTE(atan_of_, REAL)

static inline realv asin_v(realv a) { return atan2(a, sqrt(((realv)1 - a) * ((realv)1 + a))); }

static inline realv acos_v(realv a) { return atan2(sqrt(((realv)1 - a) * ((realv)1 + a)), a); }

static inline realv atan_v(realv a) { return atan(a); }
