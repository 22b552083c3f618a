// trace_table_nested.cl: the kernel of trace_nested.cl, with its step, where the lenses are in a table.
//
// provides  the kernel trace
// needs     as trace_nested.cl, behind the part of it that goes to the next surface; generated: numbers_t, scene_of(),
//           TABLE_PARAMETERS, TABLE_ARGUMENTS
kernel void trace(global const numbers_t *restrict numbers, const int lenses TABLE_PARAMETERS, const int4 tile,
                  const int max_events, END_PARAMETERS EFFECT_PARAMETERS RAY_PARAMETERS LAYER_PARAMETERS PARK_PARAMETERS
                      COUNT_PARAMETERS) {
  const layer_t layer = layer_of_item(tile LAYER_ARGUMENTS);
  const scene_t scene = scene_of(numbers, lenses, layer.number TABLE_ARGUMENTS);
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
