// paint_single.cl: 32-bit floats in memory and at work.
//
// provides  read_float(), write_float()        needs  the head: STORED, WORK

static inline WORK read_float(global const STORED *at) { return as_float(*at); }

static inline void write_float(WORK value, global STORED *at) { *at = as_uint(value); }
