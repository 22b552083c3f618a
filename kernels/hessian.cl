// hessian.cl: what is asked of a surface's second derivatives.
//
// provides  hessian_t        needs  prelude

typedef struct {
  real3v point;      // world, on the surface
  real3v way[2];     // world: small ways from there
  real3v gradient;   // out: of F in the world
  real3v change[2];  // out: what each way changes of it, to first order
} hessian_t;
