// footprint_point.cl: how a ray's start changes with its film pixel, for rays from a point.
//
// provides  footprint_ways()        needs  prelude, ray; film_t
//
// The start stays, and the direction d follows the point where the ray meets the film's plane: that is l d from the
// start, and a step there turns d by the part of it across d, over l. A source in the film's own plane has no such l:
// 0 / 0.

static inline void footprint_ways(const ray_t *ray, const scene_t *scene, real3v step, real3v *point, real3v *turn) {
  const real3v right = unit3(broadcast3(scene->film.column_step)), down = unit3(broadcast3(scene->film.row_step));
  const real3v normal = cross3(right, down);
  const real3v d = ray->direction;
  const real3v to_film = at3(broadcast3(scene->film.corner), ray->origin, (realv)-1);
  const realv nearness = dot3(normal, d) / dot3(normal, to_film);  // 1 / l
  const real3v across = at3(step, d, -dot3(step, d));
  const real3v nowhere = {(realv)0, (realv)0, (realv)0};
  *point = nowhere;
  *turn = at3(nowhere, across, nearness);
}
