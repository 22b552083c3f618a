// boxes_packet.cl: no ray goes alone: in packets so short there is nothing to gain.
//
// provides  lone_t, set_lone(), goes_alone(), next_of_lone(), as boxes_lone.cl        needs  prelude

typedef int lone_t;

static inline void set_lone(lone_t *lone, real3v origin, real3v inverse) { *lone = 0; }

static inline int goes_alone(lone_t *lone, int wide, maskv lanes) { return 0; }

static inline int next_of_lone(lone_t *lone, BOX_PARAMETERS, realv limit, maskv *lanes) { return -1; }
