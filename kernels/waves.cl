// waves.cl: sine, cosine and tangent for packets; the built-ins go lane by lane on PoCL.
//
// provides  sin_v(), cos_v(), tan_v(); quarter_wave(), WAVES_REACH        needs  prelude, functions
// source    Cody & Waite, Software Manual for the Elementary Functions, 1980, ch. 8: pi / 2 is taken off in parts whose
//           multiples are exact. The polynomials interpolate sin and cos at Chebyshev's places on [0, pi / 4]

#define IS_DOUBLE (REAL_EPSILON < NUMBER(1e-10))
#define ROUNDER (NUMBER(1.5) / REAL_EPSILON)  // a number so large keeps whole numbers only
#define WAVES_REACH PART(1e6, 1024.0)  // beyond, multiples of the parts of pi / 2 are not exact
#define PART(in_double, in_single) (realv)(IS_DOUBLE ? NUMBER(in_double) : NUMBER(in_single))

// sin(a + quarters pi / 2) to 2 ulp, |a| <= WAVES_REACH.
static inline realv quarter_wave(realv a, int quarters) {
  // Take off whole quarters of a turn
  const realv shifted = a * (realv)NUMBER(0.63661977236758134) + (realv)ROUNDER;
  const realv turns = shifted - (realv)ROUNDER;
  const bitsv quarter = as_bits(shifted) + (bitsv)(MASK)quarters;
  realv r = a - turns * PART(1.5707963267341256, 1.5703125);
  r = r - turns * PART(6.077100506303966e-11, 0.00048375129699707031);
  r = r - turns * PART(2.0222662487111665e-21, 7.549533620476723e-08);
  r = r - turns * PART(8.4784276603689e-32, 2.563344151594519e-12);

  // Sum both series; single precision needs no more than half of them
  const realv u = r * r;
  const realv s4 = (realv)NUMBER(-2.50521061673357064e-8) + u * ((realv)NUMBER(1.60585213499549863e-10) -
                                                                 u * (realv)NUMBER(7.58609478967262007e-13));
  const realv s3 = (realv)NUMBER(2.75573192191507816e-6) + (IS_DOUBLE ? u * s4 : (realv)0);
  const realv s1 = (realv)NUMBER(0.00833333333333333138) + u * ((realv)NUMBER(-0.000198412698412648216) + u * s3);
  const realv sine = r + r * u * ((realv)NUMBER(-0.166666666666666667) + u * s1);
  const realv c4 = (realv)NUMBER(2.08767557548795964e-9) + u * ((realv)NUMBER(-1.14704551782169066e-11) +
                                                                u * (realv)NUMBER(4.74553701731925837e-14));
  const realv c3 = (realv)NUMBER(-2.7557319221298087e-7) + (IS_DOUBLE ? u * c4 : (realv)0);
  const realv c1 = (realv)NUMBER(-0.00138888888888888878) + u * ((realv)NUMBER(0.0000248015873015845111) + u * c3);
  const realv cosine = (realv)1 - u * ((realv)NUMBER(0.5) - u * ((realv)NUMBER(0.0416666666666666667) + u * c1));

  const realv wave = (quarter & (bitsv)1) != (bitsv)0 ? cosine : sine;
  return (quarter & (bitsv)2) != (bitsv)0 ? -wave : wave;
}

// Rare, and so long that in line it would cost all others their registers. PoCL 3.0's sin, cos and tan of packets of floats
// are wrong by up to 0.01 in a lane if another lane holds 1e7 or more, or infinity. Those of single numbers are right.
static __attribute__((noinline)) realv far_wave(realv a, int quarters, realv near) {
#if VW == 1
  const realv far = quarters ? cos(a) : sin(a);
#else
  real lane[VW];
  store_lanes(a, lane);
  for (int i = 0; i < VW; ++i) lane[i] = quarters ? cos(lane[i]) : sin(lane[i]);
  const realv far = load_lanes(lane);
#endif
  return not_lane(abs_v(a) <= WAVES_REACH) ? far : near;
}

static inline realv sin_v(realv a) {
  const realv near = quarter_wave(a, 0);
  return any_lane(not_lane(abs_v(a) <= WAVES_REACH)) ? far_wave(a, 0, near) : near;
}

static inline realv cos_v(realv a) {
  const realv near = quarter_wave(a, 1);
  return any_lane(not_lane(abs_v(a) <= WAVES_REACH)) ? far_wave(a, 1, near) : near;
}

// Wrong by at most 8 ulp.
static inline realv tan_v(realv a) { return sin_v(a) / cos_v(a); }
