// search.cl: the question every method answers, about one surface in its own space.
//
// provides  search_t, root_t, no_root(), one_step()        needs  prelude
//
// A method provides, for each distinct surface,
//
//   root_t SURFACE(isolate)(search, shape, method)
//
// where SURFACE(name) is the surface's own version of a function, shape holds its parameters and method what the
// method reads of [numerics]. One of root_*.cl makes SURFACE(first_root)() of it, with the same parameters: the first
// root to the last bits. One of ahead_*.cl makes SURFACE(root_ahead)() of that, for a whole ray. Of the surface,
// SURFACE(gradient)(p, shape), grad F at local points, is always there; the rest is written only for the methods that
// call it:
//   SURFACE(f)(p, shape)                     F, negative inside
//   SURFACE(f_gradient)(p, shape, &g)        the same with grad F in g
//   SURFACE(leaf_f_gradient)(p, shape, leaf, &g), SURFACE(leaf_gradient)(p, shape, leaf)
//                                            of a leaf of F, a smooth part, by the number in root_t
//   SURFACE(along)(o, d, shape, c)           the coefficients of F(o + t d), a polynomial
//   SURFACE(magnitude)(p, shape)             the polynomial with all its terms positive

typedef struct {
  real3v origin;     // local; once the search begins where the ray enters the surface's bounding box, or inside it
  real3v direction;  // local, scaled so that t is in scene units
  realv length;      // where the ray leaves the box; set when the search begins
  maskv inside;      // lanes that travel in the solid: F < 0 before the root
  maskv departs;     // lanes that start on this very surface: their root at t = 0 is known and must be removed
  maskv lanes;       // lanes that ask
} search_t;

typedef struct {
  realv t;          // where found, about the first root; where undecided, up to where there is provably none
  realv low, high;  // where found: it lies between them and no other does; F changes its sign there
  maskv found;      // lanes that have one within the length
  maskv undecided;  // lanes for which neither a root nor its absence could be proved
  realv leaf;       // where found: the number of the leaf of F that crosses, in interval; 0 where F is not taken apart
  maskv steps;      // taken by each lane: looks at F along the ray, at its polynomial or at its bounds
} root_t;

static inline root_t no_root(void) {
  const root_t root = {(realv)0, (realv)0, (realv)0, (maskv)0, (maskv)0, (realv)0, (maskv)0};
  return root;
}

// To be added to the steps of the lanes that take one; free where no kernel reads them.
static inline maskv one_step(maskv lanes) { return lanes & (maskv)1; }
