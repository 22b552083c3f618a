// paint_light.cl: turn a picture into linear light once, before it is mixed many times.
//
// provides  kernel lighten
// needs     to_light(); the head: STORED, WORK, CHANNELS
//
// One work-item turns one picture pixel.
kernel void lighten(const long count, global const STORED *restrict pixels, global const float *restrict light_of,
                    global WORK *restrict light) {
  const long pixel = get_global_id(0);
  if (pixel >= count) return;
  to_light(pixels + pixel * CHANNELS, light_of, light + pixel * CHANNELS);
}
