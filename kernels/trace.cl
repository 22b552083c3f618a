// trace.cl: follow a packet of rays from the source through every surface to the picture's plane.
//
// provides  the kernel trace
// needs     prelude, ray, layer, layer_of_item(), next_ray(), parks(), count_steps(), refract(), land(), store_end(); generated:
//           scene_t, meet_lenses(), at_interface(), at_picture(), store_effects(), EFFECT_PARAMETERS, EFFECT_ARGUMENTS
// set by    the generated head: RUN

#define PARKS_FROM 2  // events: most rays have left their lens after two, and see in the third that they meet no other

// Take living rays to the next surface and through it; those that meet none stay alive and leave *travels.
static inline void to_next_surface(ray_t *ray, maskv *travels, const scene_t *scene, int max_events COUNT_PARAMETERS) {
  ray_t traveller = *ray;
  traveller.alive = *travels;
  hit_t hit;
  hit.found = (maskv)0;
  hit.doubt = (realv)REAL_MAX;
  hit.lens = NOWHERE;
  hit.searches = hit.steps = (maskv)0;
  hit.t = hit.n_lens = hit.eta = (realv)0;
  hit.point.x = hit.point.y = hit.point.z = hit.normal.x = hit.normal.y = hit.normal.z = (realv)0;
  meet_lenses(&traveller, scene, &hit);
  count_steps(&hit COUNT_ARGUMENTS);

  // End what cannot go on; a doubt behind the surface that is met does not matter
  const maskv undecided = *travels & (hit.doubt < (realv)REAL_MAX) & (not_lane(hit.found) | (hit.doubt <= hit.t));
  end_ray(ray, undecided, RAY_UNDECIDED);
  const maskv meets = *travels & hit.found & not_lane(undecided);
  const maskv trapped = meets & (ray->events >= (maskv)max_events);
  end_ray(ray, trapped, RAY_TRAPPED);
  *travels = meets & not_lane(trapped);
  if (!any_lane(*travels)) return;

  // Bend at the surface; the side is known from the ray, not from the normal
  interface_t at;
  at.lanes = *travels;
  at.length = hit.t;
  const maskv leaves = ray->inside != NOWHERE;
  at.leaves = leaves;
  at.lens = hit.lens;
  const realv n_medium = (realv)scene->n_medium;
  at.incident = ray->direction;
  const realv turns = leaves ? (realv)-1 : (realv)1;
  at.normal.x = turns * hit.normal.x;
  at.normal.y = turns * hit.normal.y;
  at.normal.z = turns * hit.normal.z;
  at.n_before = leaves ? hit.n_lens : n_medium;
  at.n_after = leaves ? n_medium : hit.n_lens;
  const real3v bent = refract(at.incident, at.normal, hit.eta, &at.total);
  at.total = at.total & at.lanes;

  // Record the event
  const maskv crosses = at.lanes & not_lane(at.total);
  ray->origin = pick3(at.lanes, hit.point, ray->origin);
  ray->direction = pick3(at.lanes, bent, ray->direction);
  ray->on = at.lanes ? hit.lens : ray->on;
  ray->inside = crosses ? (leaves ? NOWHERE : hit.lens) : ray->inside;
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
    for (int event = 0; any_lane(travels); ++event) {
      if (event >= PARKS_FROM && parks(&ray, travels, layer, first PARK_ARGUMENTS)) break;
      to_next_surface(&ray, &travels, &scene, max_events COUNT_ARGUMENTS);
    }
    const place_t place = land(&ray, &scene.picture);
    at_picture(&ray, &place, &scene);
    store_end(&ray, place, layer.start + first, END_ARGUMENTS);
    store_effects(&ray, layer.start + first EFFECT_ARGUMENTS);
  }
}
