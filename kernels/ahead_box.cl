// ahead_box.cl: a surface is searched where the ray ahead is in the lens's bounding box.
//
// provides  SURFACE(root_in_box)()        needs  prelude, placement, search, SURFACE(first_root)

// The first root of a whole ray. In the search the ray's origin is moved to its entry into the box, for the digits of a
// far origin would be lost in F; a known root must stay at t = 0.
//
//   search  in and out: origin and length become those of the way through the box, lanes those that do not pass it
//   from    out: t of the ray where the search's own begins
static inline root_t SURFACE(root_in_box)(const lens_t *lens, search_t *search, SURFACE(t) shape,
                                          const method_t *method, realv *from) {
  const maskv stays = search->departs | search->inside;
  const span_t span = span_in_box(lens, search->origin, search->direction);
  *from = stays ? (realv)0 : span.enter;
  const maskv crosses = *from < span.leave;
  const maskv lost = search->lanes & search->inside & not_lane(crosses);
  search->lanes = search->lanes & crosses;
  root_t root = no_root();
  if (any_lane(search->lanes)) {
    search->origin = at3(search->origin, search->direction, *from);
    search->length = span.leave - *from;
    root = SURFACE(first_root)(*search, shape, method);
  }
  root.t = lost ? (realv)0 : root.t;
  root.undecided = root.undecided | lost;
  return root;
}
