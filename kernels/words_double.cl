// words_double.cl: from here on the vocabulary's words are those of double precision again.
//
// provides  the end of words_single.cl        needs  a head in double precision behind it

#undef real
#undef realv
#undef maskv
#undef bitsv
#undef ubytev
#undef bytev
#undef real3v
#undef any_lane
#undef not_lane
#undef count_lanes
#undef dot3
#undef cross3
#undef unit3
#undef at3
#undef pick3
#undef broadcast3
#undef abs_v
#undef min_v
#undef max_v
#undef pow_v
#undef pow_built_in
#undef cbrt_v
#undef cbrt_normal_v
#undef down_scale
#undef norm_t
#undef norm_parts
#undef norm_v
#undef norm_slope_v
#undef search_t
#undef root_t
#undef method_t
#undef quarter_wave
#undef far_wave
#undef sin_v
#undef cos_v
#undef tan_v
#undef no_root
#undef one_step
#undef zone_t
#undef no_zone
#undef zones_of
