// words_single.cl: from here on the vocabulary's words are those of single precision, beside the double ones.
//
// provides  the words of the vocabulary and of search.cl under other names, for a kernel that carries rays in double
//           and searches in single; words_double.cl ends it
// needs     a head in single precision behind it, then the vocabulary once more

#define real single_real
#define realv single_realv
#define maskv single_maskv
#define bitsv single_bitsv
#define ubytev single_ubytev
#define bytev single_bytev
#define real3v single_real3v
#define any_lane single_any_lane
#define not_lane single_not_lane
#define count_lanes single_count_lanes
#define dot3 single_dot3
#define cross3 single_cross3
#define unit3 single_unit3
#define at3 single_at3
#define pick3 single_pick3
#define broadcast3 single_broadcast3
#define abs_v single_abs_v
#define min_v single_min_v
#define max_v single_max_v
#define pow_v single_pow_v
#define pow_built_in single_pow_built_in
#define cbrt_v single_cbrt_v
#define cbrt_normal_v single_cbrt_normal_v
#define down_scale single_down_scale
#define norm_t single_norm_t
#define norm_parts single_norm_parts
#define norm_v single_norm_v
#define norm_slope_v single_norm_slope_v
#define search_t single_search_t
#define root_t single_root_t
#define method_t single_method_t
#define quarter_wave single_quarter_wave
#define far_wave single_far_wave
#define sin_v single_sin_v
#define cos_v single_cos_v
#define tan_v single_tan_v
#define no_root single_no_root
#define one_step single_one_step
#define zone_t single_zone_t
#define no_zone single_no_zone
#define zones_of single_zones_of
