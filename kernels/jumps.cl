// jumps.cl: the sign of a number and the whole number below it, for packets.
//
// provides  sign_v(), floor_v()        needs  prelude, functions
//
// A mixed kernel has these words in both precisions, each under its own name.

#undef sign_v
#undef floor_v
#define sign_v PASTE(sign_of_, REAL)
#define floor_v PASTE(floor_of_, REAL)

// -1, 0 or 1. The built-in makes 0 of NaN; here it stays NaN.
static inline realv sign_v(realv a) { return a < (realv)0 ? (realv)-1 : (a > (realv)0 ? (realv)1 : a); }

// The nearest whole number, or the one below. The built-in is a call on PoCL. From 1 / REAL_EPSILON on all numbers are whole.
static inline realv floor_v(realv a) {
  const realv whole = (realv)((real)1 / REAL_EPSILON);
  const realv near = a < (realv)0 ? whole - (whole - a) : (a + whole) - whole;
  return abs_v(a) < whole ? (near > a ? near - (realv)1 : near) : a;
}
