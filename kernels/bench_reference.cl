// bench_reference.cl: the frozen kernel that every benchmark is interleaved with.
//
// provides  the kernel reference
// set by    its own head: REAL float|double, PACKET float|floatN|double|doubleN, N rays to a work-item
//
// DO NOT CHANGE THIS FILE, not even a comment: figures of different days are compared by their ratios to it, and a test
// holds its digest. It needs no other file, so that no work on them can change it either. It is plain on purpose, and
// does the work of a tracer: a march in fixed steps, Newton, Snell's law, divisions and square roots, in packets.
//
// Rays from (0, 0, 4) through (x, y, 2.5) look for the torus F = (p.p + R^2 - r^2)^2 - 4 R^2 (x^2 + y^2), R = 3/4,
// r = 1/4, about the z axis; they are bent into it and out of it, index 3/2, and land on the plane z = -2.5. Every ray
// takes the same time whatever it meets: loops have fixed counts, what does not apply is computed and not chosen.
// All constants are exact in single precision.

#define STEPS 48  // of a march
#define POLISHES 5

static inline PACKET torus(PACKET x, PACKET y, PACKET z) {
  const PACKET ring = x * x + y * y;
  const PACKET sum = ring + z * z + (PACKET)0.5f;
  return sum * sum - (PACKET)2.25f * ring;
}

// The first of STEPS samples ahead at which sign F < 0, polished; -1 where there is none.
static inline PACKET first_root(PACKET px, PACKET py, PACKET pz, PACKET dx, PACKET dy, PACKET dz, PACKET length,
                                PACKET sign) {
  const PACKET step = length * (PACKET)(1.0f / 64);
  PACKET t = (PACKET)-1;
  for (int k = STEPS; k > 0; --k) {
    const PACKET there = step * (PACKET)(REAL)k;
    const PACKET f = sign * torus(px + there * dx, py + there * dy, pz + there * dz);
    t = f < (PACKET)0 ? there : t;
  }
  const PACKET sample = t;
  for (int k = 0; k < POLISHES; ++k) {
    const PACKET x = px + t * dx, y = py + t * dy, z = pz + t * dz;
    const PACKET sum = x * x + y * y + z * z + (PACKET)0.5f;
    const PACKET slope = ((PACKET)4 * sum - (PACKET)4.5f) * (x * dx + y * dy) + (PACKET)4 * sum * z * dz;
    t = t - torus(x, y, z) / slope;
  }
  return sample < (PACKET)0 ? sample : t;
}

kernel void reference(global const PACKET *film_x, global const PACKET *film_y, global PACKET *seen_x,
                      global PACKET *seen_y, const int packets) {
  const int packet = (int)get_global_id(0);
  if (packet >= packets) return;

  // A unit ray, where it enters the slab |z| <= 1/4
  PACKET dx = film_x[packet], dy = film_y[packet], dz = (PACKET)-1.5f;
  const PACKET scale = (PACKET)1 / sqrt(dx * dx + dy * dy + dz * dz);
  dx = dx * scale, dy = dy * scale, dz = dz * scale;
  const PACKET enter = (PACKET)-3.75f / dz;
  PACKET px = enter * dx, py = enter * dy, pz = (PACKET)0.25f;

  // Into the torus, and out of it
  PACKET alive = (PACKET)1;
  PACKET sign = (PACKET)1;
  PACKET eta = (PACKET)((REAL)2 / (REAL)3);
  PACKET length = (PACKET)-0.75f / dz;
  for (int surface = 0; surface < 2; ++surface) {
    const PACKET t = first_root(px, py, pz, dx, dy, dz, length, sign);
    const PACKET x = px + t * dx, y = py + t * dy, z = pz + t * dz;

    // The unit normal against the ray
    const PACKET sum = x * x + y * y + z * z + (PACKET)0.5f;
    const PACKET ring = (PACKET)4 * sum - (PACKET)4.5f;
    PACKET nx = ring * x, ny = ring * y, nz = (PACKET)4 * sum * z;
    const PACKET unit = sign / sqrt(nx * nx + ny * ny + nz * nz);
    nx = nx * unit, ny = ny * unit, nz = nz * unit;

    // Snell's law; what would be totally reflected goes straight on
    const PACKET cosine = -(dx * nx + dy * ny + dz * nz);
    const PACKET square = (PACKET)1 - eta * eta * ((PACKET)1 - cosine * cosine);
    const PACKET along = eta * cosine - sqrt(square < (PACKET)0 ? (PACKET)0 : square);
    alive = t < (PACKET)0 ? (PACKET)0 : alive;
    const PACKET bends = square < (PACKET)0 ? (PACKET)0 : alive;
    dx = bends > (PACKET)0 ? eta * dx + along * nx : dx;
    dy = bends > (PACKET)0 ? eta * dy + along * ny : dy;
    dz = bends > (PACKET)0 ? eta * dz + along * nz : dz;
    px = alive > (PACKET)0 ? x : px;
    py = alive > (PACKET)0 ? y : py;
    pz = alive > (PACKET)0 ? z : pz;
    sign = -sign;
    eta = (PACKET)1.5f;
    length = (PACKET)1;
  }

  // The plane z = -2.5
  const PACKET far = ((PACKET)-2.5f - pz) / dz;
  seen_x[packet] = px + far * dx;
  seen_y[packet] = py + far * dy;
}
