// sets_bits.cl: sets of lenses that have a bit each.
//
// provides  HAS_LENS(), NOTE_CROSSED(), settle_solids()        needs  prelude, ray_nested

// Lanes of a ray that have this lens in a set, and that it is among those crossed, alone or with others.
#define HAS_LENS(ray, set) (((set) & LENS_BIT) != (maskv)0)
#define NOTE_CROSSED(hit, alone, contact)

static inline void settle_solids(ray_t *ray, hit_t *hit) {}
