// table_nested.cl: table.cl where solids may touch or overlap.
//
// provides  start_at_lenses(), meet_lenses()
// needs     prelude, functions, ray_nested, distinct, boxes; generated: lens_start(), lens_meet()
//
// The solids that a ray travels in are asked first, whatever their boxes. Of the others those are asked whose boxes lie
// nearer than what is met, with what lies within rounding of it: faces in contact are one interface.

#define NEARLY NUMBER(1e-6)  // of the lengths at hand: far more than faces in contact seem apart

static inline maskv numbers_in(const ray_t *ray, maskv set, int colour) {
  return (ray->alive & ((set & (maskv)(MASK)(1 << colour)) != (maskv)0)) ? ray->solids[colour] : NOWHERE;
}

static inline void start_at_lenses(ray_t *ray, const scene_t *scene) {
  for (int colour = 0; colour < COLOURS; ++colour) {
    maskv on = numbers_in(ray, ray->on, colour);
    for (int number = largest_lane(on); number >= 0; number = largest_lane(on)) {
      lens_start(number, ray, scene);
      on = on == (maskv)number ? NOWHERE : on;
    }
  }
}

static inline void meet_lenses(const ray_t *ray, const scene_t *scene, hit_t *hit) {
  ray_t asking = *ray;
  walk_t walk = walk_boxes(ray, ray->alive);
  int colour = 0;
  maskv within = numbers_in(ray, ray->inside, 0);
  for (;;) {
    int number = largest_lane(within);
    while (number < 0 && ++colour < COLOURS) {
      within = numbers_in(ray, ray->inside, colour);
      number = largest_lane(within);
    }
    if (number >= 0) {
      asking.alive = within == (maskv)number;
      within = asking.alive ? NOWHERE : within;
    } else {
      const realv met = min_v(hit->found ? hit->high : (realv)REAL_MAX, hit->doubt);
      const realv limit = min_v(met + (realv)NEARLY * (met + longest(ray->origin)), (realv)REAL_MAX);
      number = next_lens(&walk, scene->boxes, scene->links, scene->wide_boxes, scene->wide_links, limit, &asking.alive);
      if (number < 0) return;
      for (int c = 0; c < COLOURS; ++c) {
        asking.alive = asking.alive & not_lane(numbers_in(ray, ray->inside, c) == (maskv)number);
      }
    }
    lens_meet(number, &asking, scene, hit);
  }
}
#undef NEARLY
