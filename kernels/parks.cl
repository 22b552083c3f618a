// parks.cl: rays that travel on almost alone in their packet are put aside, and carried on in full packets by another
// launch: a few that are trapped by total reflection would else hold up their packet to the last event.
//
// provides  next_ray(), parks(), PARK_PARAMETERS, PARK_ARGUMENTS
// needs     lanes, ray, layer, first_ray(), start(); packets of 4 or more
// set by    the generated head: RAY_WORDS, the members of ray_t
//
// A ray is put aside as it stands, word by word, for every member of ray_t is a vector of lanes. Each layer has a part
// of its own of places and words, with room for so many rays, and a count in parked: a packet that is carried on has
// rays of one layer, and the launch that does so a tile as large as the largest count.

#define PARK_PARAMETERS                                                                              \
  , const int carries_on, const int room, global int *restrict parked, global int *restrict places,   \
      global MASK *restrict words
#define PARK_ARGUMENTS , carries_on, room, parked, places, words

typedef char ray_t_is_as_long_as_the_host_knows[sizeof(ray_t) == RAY_WORDS * sizeof(realv) ? 1 : -1];
#define ALMOST_ALONE (VW / 4)  // as the host knows: so many of every packet may be put aside

typedef union {
  ray_t ray;
  MASK words[sizeof(ray_t) / sizeof(MASK)];
} ray_words_t;

typedef union {
  maskv mask;
  MASK lanes[VW];
} lanes_t;

// The packet that begins with ray first: of the tile, or of those that its layer has put aside.
static inline ray_t next_ray(const scene_t *scene, layer_t layer, int4 tile, int first RAY_PARAMETERS PARK_PARAMETERS) {
  if (!carries_on) {
    ray_t ray = first_ray(&scene->film, &scene->source, tile, first RAY_ARGUMENTS);
    start(&ray, scene);
    return ray;
  }
  ray_words_t all;
  const int begin = layer.number * room + first;
  for (int lane = 0; lane < VW; ++lane) {
    for (int i = 0; i < RAY_WORDS; ++i) all.words[i * VW + lane] = words[(begin + lane) * RAY_WORDS + i];
  }
  all.ray.alive = all.ray.alive & (LANES < (realv)(real)(parked[layer.number] - first));
  return all.ray;
}

// Put the travelling lanes aside if they are few; says whether. A ray is put aside once.
static inline int parks(const ray_t *ray, maskv travels, layer_t layer, int first PARK_PARAMETERS) {
  const int few = count_lanes(travels);
  if (carries_on || few > ALMOST_ALONE || few == 0) return 0;
  ray_words_t all;
  lanes_t goes;
  all.ray = *ray;
  goes.mask = travels;
  int place = layer.number * room + atomic_add(parked + layer.number, few);
  for (int lane = 0; lane < VW; ++lane) {
    if (!goes.lanes[lane]) continue;
    for (int i = 0; i < RAY_WORDS; ++i) words[place * RAY_WORDS + i] = all.words[i * VW + lane];
    places[place++] = first + lane;
  }
  return 1;
}
