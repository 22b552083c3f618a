// paint_mean.cl: colour film pixels by the mean of the light of their samples.
//
// provides  kernel mean        needs  from_light(); the head: STORED, WORK, CHANNELS
//
// One work-item colours one film pixel; it holds the colour of its own ray, whose hidden colour stays where the mean is
// transparent. The mean starts from the first sample and adds differences, so equal samples give exactly themselves.
kernel void mean(const long count, const int each, global const long *restrict film_pixels,
                 global const WORK *restrict samples, global const float *restrict srgb_of, global STORED *painted) {
  const long pixel = get_global_id(0);
  if (pixel >= count) return;
  global const WORK *first = samples + pixel * each * CHANNELS;
  WORK light[CHANNELS];
  for (int c = 0; c < CHANNELS; ++c) {
    WORK beyond = (WORK)0;
    for (int sample = 1; sample < each; ++sample) beyond += first[sample * CHANNELS + c] - first[c];
    light[c] = first[c] + beyond / (WORK)each;
  }
  global STORED *colour = painted + film_pixels[pixel] * CHANNELS;
  from_light(light, srgb_of, colour, colour);
}
