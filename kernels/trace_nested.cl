// trace_nested.cl: trace.cl where solids may touch or overlap.
//
// provides  the kernel trace
// needs     as trace.cl, with ray_nested in place of ray; picture_met(), settle_solids(); generated: medium_of(), index_of(), meet_lenses()
// set by    the generated head: RUN

#define PARKS_FROM 2  // events: most rays have left their lens after two, and see in the third that they meet no other

// Take living rays to the next surface and through it; those that meet none, or the picture before one, stay alive and
// leave *travels.
static inline void to_next_surface(ray_t *ray, maskv *travels, const scene_t *scene, int max_events COUNT_PARAMETERS) {
  ray_t traveller = *ray;
  traveller.alive = *travels;
  hit_t hit;
  hit.found = hit.crossed = (maskv)0;
  hit.doubt = (realv)REAL_MAX;
  hit.lens = NOWHERE;
  hit.searches = hit.steps = (maskv)0;
  hit.t = hit.low = hit.high = (realv)0;
  hit.point.x = hit.point.y = hit.point.z = hit.normal.x = hit.normal.y = hit.normal.z = (realv)0;
  meet_lenses(&traveller, scene, &hit);
  count_steps(&hit COUNT_ARGUMENTS);
  const maskv stopped = picture_met(ray, *travels, &hit, &scene->picture);
  settle_solids(ray, &hit);

  // End what cannot go on; a doubt behind what is met does not matter
  const maskv unproved = not_lane(hit.found | stopped) | not_lane(hit.doubt > hit.high);
  const maskv undecided = *travels & (hit.doubt < (realv)REAL_MAX) & unproved;
  end_ray(ray, undecided, RAY_UNDECIDED);
  const maskv meets = *travels & hit.found & not_lane(undecided);
  const maskv behind = ray->inside ^ hit.crossed;
  const maskv before = medium_of(ray->inside), after = medium_of(behind);
  const maskv passes = meets & (before == after);  // within one medium: no event
  const maskv trapped = meets & not_lane(passes) & (ray->events >= (maskv)max_events);
  end_ray(ray, trapped, RAY_TRAPPED);
  *travels = meets & not_lane(trapped);
  if (!any_lane(*travels)) return;

  // Bend at the surface
  interface_t at;
  at.lanes = *travels & not_lane(passes);
  at.length = ray->passed + hit.t;
  at.leaves = before != NOWHERE;
  at.lens = hit.lens;
  at.before = before;
  at.after = after;
  at.incident = ray->direction;
  at.normal = hit.normal;
  at.n_before = index_of(scene, before);
  at.n_after = index_of(scene, after);
  const real3v bent = refract(at.incident, at.normal, at.n_before / at.n_after, &at.total);
  at.total = at.total & at.lanes;

  // Record the event
  const maskv crosses = *travels & not_lane(at.total);
  ray->origin = pick3(*travels, hit.point, ray->origin);
  ray->direction = pick3(at.lanes, bent, ray->direction);
  ray->on = *travels ? hit.crossed : ray->on;
  ray->inside = crosses ? behind : ray->inside;
  ray->passed = *travels ? (passes ? ray->passed + hit.t : (realv)0) : ray->passed;
  if (!any_lane(at.lanes)) return;
  ray->events = at.lanes ? ray->events + (maskv)1 : ray->events;
  at_interface(ray, &at, scene);
  *travels = *travels & ray->alive;
}

// One work-item carries RUN packets of the tile, one after the other: what they share is read once.
kernel void trace(global const scene_t *restrict numbers, const int4 tile, const int max_events,
                  END_PARAMETERS EFFECT_PARAMETERS RAY_PARAMETERS LAYER_PARAMETERS PARK_PARAMETERS
                      COUNT_PARAMETERS) {
  const layer_t layer = layer_of_item(tile LAYER_ARGUMENTS);
  const scene_t scene = numbers[layer.number];
  const int begin = layer.item * (RUN * VW);
  const int end = tile.w - begin < RUN * VW ? tile.w : begin + RUN * VW;
  for (int first = begin; first < end; first += VW) {
    ray_t ray = next_ray(&scene, layer, tile, first RAY_ARGUMENTS PARK_ARGUMENTS);
    maskv travels = ray.alive;
    for (int step = 0; any_lane(travels); ++step) {
      if (step >= PARKS_FROM && parks(&ray, travels, layer, first PARK_ARGUMENTS)) break;
      to_next_surface(&ray, &travels, &scene, max_events COUNT_ARGUMENTS);
    }
    place_t place = land_from_glass(&ray, &scene.picture);
    place.distance += ray.passed;  // from the last event
    at_picture(&ray, &place, &scene);
    ray.origin = at3(ray.origin, ray.direction, -ray.passed);
    store_end(&ray, place, layer.start + first, END_ARGUMENTS);
    store_effects(&ray, layer.start + first EFFECT_ARGUMENTS);
  }
}
