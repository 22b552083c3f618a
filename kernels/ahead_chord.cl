// ahead_chord.cl: where a ray enters or leaves a convex quadric, without a box.
//
// provides  SURFACE(root_ahead)()
// needs     prelude, functions, search, polynomial_ray of degree 2, SURFACE(root_in_box), for rays that are not certain
//           here or start inside
//
// Along the ray F is c0 + c1 t + c2 t^2 with c2 > 0: of its two roots a ray from outside wants the first, a ray that has
// just entered the other one. N bounds the rounding of F, and of each of its terms, over all the length that is looked at.

// A ray that has entered: without its known root F is c1 t + c2 t^2, and the other root is -c1 / c2. Where the two terms are
// more than 2 N there, both signs are certain.
static inline maskv SURFACE(leave)(const search_t *search, SURFACE(t) shape, root_t *root) {
  realv c[3];
  SURFACE(along)(search->origin, search->direction, shape, c);
  root->t = -c[1] / c[2];
  const realv term = -c[1] * root->t;
  const realv noise = SURFACE(rounding)(search->origin, search->direction, root->t, shape);
  root->found = search->lanes;
  return (root->t > (realv)0) & (term > (realv)2 * noise) & SURFACE(in_range)(term, noise);
}

// A ray from outside: the origin is moved to the middle between the roots, at -c1 / (2 c2), where F is e0 + 2 b u + c2 u^2
// with b no more than rounding. They lie sqrt(b^2 - e0 c2) / c2 from there, half a chord T apart. Where F is D = c2 T^2
// below the surface in the middle, or above it where there are none, errors are N at most in e0, N / T in b and N / T^2 in
// c2. With D > 4 N the middle errs by less than T / 8 and a quarter of its own distance, so it is told on which side of the
// origin it is, the origin being outside for certain and thus no nearer to it than T. Of a middle that errs so, b is less
// than 3/8 c2 T, and D errs by less than N (1 + 2 * 3/8 + 1) and terms of second order, less than 4 N: whether there are
// roots is told, too.
static inline maskv SURFACE(enter)(search_t *search, SURFACE(t) shape, realv *from, root_t *root) {
  realv c[3], e[3];
  SURFACE(along)(search->origin, search->direction, shape, c);
  const realv inverse = (realv)1 / c[2];
  const realv middle = (realv)NUMBER(-0.5) * c[1] * inverse;
  const real3v centre = at3(search->origin, search->direction, middle);
  SURFACE(along)(centre, search->direction, shape, e);
  const realv b = (realv)NUMBER(0.5) * e[1];
  const realv square = b * b - e[0] * c[2];
  const realv size = abs_v(square), reach = sqrt(size);
  const realv depth = size * inverse;
  const realv noise =
      SURFACE(rounding)(search->origin, search->direction, abs_v(middle) + reach * inverse, shape);
  const maskv certain = (c[0] > noise) & (depth > (realv)4 * noise) & (b * b <= size) & SURFACE(in_range)(depth, noise);

  search->origin = centre;
  *from = middle;
  root->t = -(b + reach) * inverse;
  root->found = search->lanes & (square > (realv)0) & (middle > (realv)0);
  return certain;
}

// A packet of both kinds, or with a ray that is not certain: each ray is told as it would be in any other packet, and those
// that are not certain are searched in the box.
static inline root_t SURFACE(roots_apart)(const lens_t *lens, search_t *search, SURFACE(t) shape, const method_t *method,
                                          realv *from) {
  search_t inner = *search, outer = *search, boxed = *search;
  inner.lanes = search->lanes & search->inside & search->departs;
  outer.lanes = search->lanes & not_lane(search->inside | search->departs);
  root_t left = no_root(), entered = no_root();
  realv middle, enters;
  const maskv leaves = inner.lanes & SURFACE(leave)(&inner, shape, &left);
  const maskv meets = outer.lanes & SURFACE(enter)(&outer, shape, &middle, &entered);
  boxed.lanes = search->lanes & not_lane(leaves | meets);
  root_t root = SURFACE(root_in_box)(lens, &boxed, shape, method, &enters);

  const real3v start = pick3(meets, outer.origin, boxed.origin);
  search->origin = pick3(leaves, search->origin, start);
  search->lanes = leaves | meets | boxed.lanes;
  *from = leaves ? (realv)0 : meets ? middle : enters;
  root.t = leaves ? left.t : meets ? entered.t : root.t;
  root.low = leaves | meets ? root.t : root.low;
  root.high = leaves | meets ? root.t : root.high;
  root.found = leaves | (meets & entered.found) | root.found;
  root.steps = leaves | meets ? one_step(search->lanes) : root.steps;
  return root;
}

static inline root_t SURFACE(root_ahead)(const lens_t *lens, search_t *search, SURFACE(t) shape, const method_t *method,
                                         realv *from) {
  const maskv entered = search->inside & search->departs, outside = not_lane(search->inside | search->departs);
  search_t moved = *search;
  root_t root = no_root();
  maskv certain = (maskv)0;
  *from = (realv)0;
  if (!any_lane(search->lanes & not_lane(entered))) {
    certain = SURFACE(leave)(search, shape, &root);
  } else if (!any_lane(search->lanes & not_lane(outside))) {
    certain = SURFACE(enter)(&moved, shape, from, &root);
  }
  if (any_lane(search->lanes & not_lane(certain))) return SURFACE(roots_apart)(lens, search, shape, method, from);
  search->origin = moved.origin;
  root.low = root.high = root.t;
  root.steps = one_step(search->lanes);
  return root;
}
