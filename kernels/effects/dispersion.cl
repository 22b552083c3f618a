// dispersion.cl: a scene's numbers stand there once for every wavelength, and every ray is traced by each of them.
//
// provides  layer_of_item(), LAYER_PARAMETERS, LAYER_ARGUMENTS, as layer_single.cl        needs  layer
//
// The work-items of one wavelength carry whole packets of the tile, and those of the next follow: all lanes of a packet
// have one index. In the arrays the ends of a wavelength's rays follow those of the one before, padded to whole packets.

#define LAYER_PARAMETERS , const int wavelengths
#define LAYER_ARGUMENTS , wavelengths

static inline layer_t layer_of_item(int4 tile LAYER_PARAMETERS) {
  const int packets = (tile.w + VW - 1) / VW;
  const int items = (packets + RUN - 1) / RUN;
  const int item = (int)get_global_id(0);
  // Items that only fill up the launch belong to the last wavelength, and lie beyond its tile
  const int number = item / items < wavelengths ? item / items : wavelengths - 1;
  const layer_t layer = {number, item - number * items, number * packets * VW};
  return layer;
}
