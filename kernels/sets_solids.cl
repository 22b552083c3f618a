// sets_solids.cl: sets of very many lenses. Lenses whose boxes overlap differ in colour, and a set has a bit for each colour:
// no point lies in two of one colour. Which lens of a colour it is stands beside the set.
//
// provides  HAS_LENS(), NOTE_CROSSED(), settle_solids(), medium_of()
// needs     prelude, functions, ray_nested; lens_t { colour }
// set by    the generated head: COLOURS
//
// Of a ray, solids[c] is the lens of colour c in `inside` or `on`, of a hit that in `crossed`; without that bit it is any.
// Lenses are numbered by priority, lowest first: the largest number is that of the medium.

#define HAS_LENS(ray, set) \
  ((((set) & LENS_BIT) != (maskv)0) & ((ray)->solids[(int)lens->colour] == (maskv)LENS_NUMBER))

// Two of one colour would be in contact: that is not so, and what rounding has made of it is not known.
#define NOTE_CROSSED(hit, alone, contact)                                                                         \
  const maskv of_one_colour = (contact) & not_lane(alone) & (((hit)->crossed & LENS_BIT) != (maskv)0);             \
  (hit)->doubt = of_one_colour ? (realv)0 : (hit)->doubt;                                                         \
  (hit)->solids[(int)lens->colour] = (alone) | (contact) ? (maskv)LENS_NUMBER : (hit)->solids[(int)lens->colour]

// Let the ray know the lenses that it crosses. A ray in one lens that is to cross another of its colour is in doubt.
static inline void settle_solids(ray_t *ray, hit_t *hit) {
  for (int colour = 0; colour < COLOURS; ++colour) {
    const maskv bit = (maskv)(MASK)(1 << colour);
    const maskv crosses = ray->alive & hit->found & ((hit->crossed & bit) != (maskv)0);
    const maskv other = ((ray->inside & bit) != (maskv)0) & not_lane(ray->solids[colour] == hit->solids[colour]);
    hit->doubt = (crosses & other) ? (realv)0 : hit->doubt;
    ray->solids[colour] = crosses ? hit->solids[colour] : ray->solids[colour];
  }
}

static inline maskv medium_in(maskv set, const maskv *solids) {
  maskv medium = NOWHERE;
  for (int colour = 0; colour < COLOURS; ++colour) {
    const maskv has = (set & (maskv)(MASK)(1 << colour)) != (maskv)0;
    medium = (has & (solids[colour] > medium)) ? solids[colour] : medium;
  }
  return medium;
}
#define medium_of(set) medium_in(set, ray->solids)
