// trace_table.cl: the kernel of trace.cl, with its step from surface to surface, where the lenses are in a table.
//
// provides  the kernel trace
// needs     as trace.cl, behind the part of it that goes to the next surface; generated: numbers_t, scene_of(),
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
