// dispersion.cl: a scene's numbers stand there once for every wavelength, and every ray is traced by each of them.
//
// provides  layer_of_item(), layer_t; next_ray(), parks(), PARK_PARAMETERS, PARK_ARGUMENTS, as parks_never.cl
// needs     ray, first_ray(), start()
//
// The work-items of one wavelength carry whole packets of the tile, and those of the next follow: all lanes of a packet
// have one index. In the arrays the ends of a wavelength's rays follow those of the one before, padded to whole packets.
// No ray is put aside, as parks.cl does: packets of those would mix wavelengths. Where a few rays of a packet are
// trapped, the others wait for them, and all take up to twice as long.

#define PARK_PARAMETERS , const int wavelengths
#define PARK_ARGUMENTS , wavelengths

typedef struct {
  int number;  // of the wavelength
  int item;    // which of its work-items
  int start;   // where its rays begin in the arrays
} layer_t;

static inline layer_t layer_of_item(int4 tile PARK_PARAMETERS) {
  const int packets = (tile.w + VW - 1) / VW;
  const int items = (packets + RUN - 1) / RUN;
  const int item = (int)get_global_id(0);
  // Items that only fill up the launch belong to the last wavelength, and lie beyond its tile
  const int number = item / items < wavelengths ? item / items : wavelengths - 1;
  const layer_t layer = {number, item - number * items, number * packets * VW};
  return layer;
}

static inline ray_t next_ray(const scene_t *scene, int4 tile, int first RAY_PARAMETERS PARK_PARAMETERS) {
  ray_t ray = first_ray(&scene->film, &scene->source, tile, first RAY_ARGUMENTS);
  start(&ray, scene);
  return ray;
}

static inline int parks(const ray_t *ray, maskv travels, int first PARK_PARAMETERS) { return 0; }
