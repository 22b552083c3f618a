// table.cl: a packet and the lenses of a table: those that its rays travel in, and those whose boxes they meet.
//
// provides  start_at_lenses(), meet_lenses()
// needs     prelude, functions, ray, distinct, boxes; generated: lens_start(), lens_meet()
//
// A lens is asked with those lanes alive that may meet it. Rays that travel in a solid ask its surface alone; the others
// ask, nearest first, where the box of a solid lies nearer than what they have met. What a lens says of a lane that does
// not meet its box is known: nothing. What lies beyond a doubt does not matter, for there the ray ends as undecided.

// Rays that start on surfaces start inside if they enter.
static inline void start_at_lenses(ray_t *ray, const scene_t *scene) {
  maskv on = ray->alive ? ray->on : NOWHERE;
  for (int number = largest_lane(on); number >= 0; number = largest_lane(on)) {
    lens_start(number, ray, scene);
    on = on == (maskv)number ? NOWHERE : on;
  }
}

static inline void meet_lenses(const ray_t *ray, const scene_t *scene, hit_t *hit) {
  ray_t asking = *ray;
  maskv within = ray->alive ? ray->inside : NOWHERE;
  walk_t walk = walk_boxes(ray, ray->alive & (ray->inside == NOWHERE));
  for (;;) {
    int number = largest_lane(within);
    if (number >= 0) {
      asking.alive = within == (maskv)number;
      within = asking.alive ? NOWHERE : within;
    } else {
      const realv limit = min_v(hit->found ? hit->t : (realv)REAL_MAX, hit->doubt);
      number = next_lens(&walk, scene->boxes, scene->links, scene->wide_boxes, scene->wide_links, limit, &asking.alive);
      if (number < 0) return;
    }
    lens_meet(number, &asking, scene, hit);
  }
}
