// layer_single.cl: one set of the scene's numbers serves all work-items, and every array has one layer.
//
// provides  layer_of_item(), LAYER_PARAMETERS, LAYER_ARGUMENTS        needs  layer

#define LAYER_PARAMETERS
#define LAYER_ARGUMENTS

static inline layer_t layer_of_item(int4 tile) {
  const layer_t layer = {0, (int)get_global_id(0), 0};
  return layer;
}
