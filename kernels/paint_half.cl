// paint_half.cl: 16-bit floats in memory, 32 bits at work.
//
// provides  read_float(), write_float()        needs  the head: STORED, WORK

static inline WORK read_float(global const STORED *at) { return vload_half(0, (global const half *)at); }

static inline void write_float(WORK value, global STORED *at) { vstore_half_rte(value, 0, (global half *)at); }
