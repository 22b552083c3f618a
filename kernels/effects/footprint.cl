// footprint.cl: how a ray's place on the picture changes with its film pixel, carried through every surface.
//
// provides  footprint_start(), footprint_interface(), footprint_landing()
// needs     prelude, ray, screen, hessian, mirrored, footprint_ways(), footprint_bent(); generated: at_lens_hessian()
// carries   point_*, turn_*: the changes of the ray's origin and direction, _by_row and _by_column, world;
//           s_by_row, s_by_column, t_by_row, t_by_column: of the place, once it has landed
// source    Igehy, Tracing Ray Differentials, SIGGRAPH 1999
//
// The changes are to first order, so every step is linear in them. Where there is none, at an edge or a singular point,
// what comes is of no meaning; where it is no number, or none that a place could be, 0.

typedef struct {
  real3v point, turn;  // what a step of one pixel changes of the ray's origin and direction
} footprint_t;

static inline void footprint_read(const ray_t *ray, footprint_t by[2]) {
  const footprint_t row = {{ray->point_x_by_row, ray->point_y_by_row, ray->point_z_by_row},
                           {ray->turn_x_by_row, ray->turn_y_by_row, ray->turn_z_by_row}};
  const footprint_t column = {{ray->point_x_by_column, ray->point_y_by_column, ray->point_z_by_column},
                              {ray->turn_x_by_column, ray->turn_y_by_column, ray->turn_z_by_column}};
  by[0] = row;
  by[1] = column;
}

static inline void footprint_keep(ray_t *ray, const footprint_t by[2]) {
  ray->point_x_by_row = by[0].point.x;
  ray->point_y_by_row = by[0].point.y;
  ray->point_z_by_row = by[0].point.z;
  ray->turn_x_by_row = by[0].turn.x;
  ray->turn_y_by_row = by[0].turn.y;
  ray->turn_z_by_row = by[0].turn.z;
  ray->point_x_by_column = by[1].point.x;
  ray->point_y_by_column = by[1].point.y;
  ray->point_z_by_column = by[1].point.z;
  ray->turn_x_by_column = by[1].turn.x;
  ray->turn_y_by_column = by[1].turn.y;
  ray->turn_z_by_column = by[1].turn.z;
}

// The change of the point where a ray meets a plane, or a surface by its tangent plane, after a length.
static inline real3v footprint_on_plane(footprint_t by, real3v direction, real3v normal, realv length) {
  const real3v moved = at3(by.point, by.turn, length);
  return at3(moved, direction, -dot3(normal, moved) / dot3(normal, direction));
}

static inline void footprint_start(ray_t *ray, const scene_t *scene) {
  footprint_t by[2];
  footprint_ways(ray, scene, broadcast3(scene->film.row_step), &by[0].point, &by[0].turn);
  footprint_ways(ray, scene, broadcast3(scene->film.column_step), &by[1].point, &by[1].turn);
  footprint_keep(ray, by);
  ray->s_by_row = ray->s_by_column = ray->t_by_row = ray->t_by_column = (realv)0;
}

static inline void footprint_interface(ray_t *ray, const interface_t *at, const scene_t *scene) {
  footprint_t by[2];
  footprint_read(ray, by);
  const real3v d = at->incident, n = unit3(at->normal);

  // Move the points along the surface, and ask how its gradient turns there
  hessian_t curve;
  curve.point = ray->origin;
  curve.gradient = curve.change[0] = curve.change[1] = n;
  for (int i = 0; i < 2; ++i) curve.way[i] = footprint_on_plane(by[i], d, n, at->length);
  at_lens_hessian(scene, at->lanes ? at->lens : NOWHERE, &curve);

  // The unit normal turns by the part of that across itself. Its length along n has the sign of the side of n
  const realv inverse = (realv)1 / dot3(curve.gradient, n);
  const realv eta = at->n_before / at->n_after;
  const maskv lanes = at->lanes & ray->alive;
  for (int i = 0; i < 2; ++i) {
    const real3v h = curve.change[i];
    const real3v across = at3(h, n, -dot3(h, n));
    const real3v n_change = {inverse * across.x, inverse * across.y, inverse * across.z};
    real3v turn = footprint_bent(d, ray->direction, n, eta, by[i].turn, n_change);

    // Reflection is linear in d, and n turns by n_change: in d - 2 (d.n) n it stands twice
    if (any_lane(at->total)) {
      const real3v along_n = at3(mirrored(by[i].turn, n), n, (realv)-2 * dot3(d, n_change));
      turn = pick3(at->total, at3(along_n, n_change, (realv)-2 * dot3(d, n)), turn);
    }
    by[i].turn = pick3(lanes, turn, by[i].turn);
    by[i].point = pick3(lanes, curve.way[i], by[i].point);
  }
  footprint_keep(ray, by);
}

static inline realv footprint_number(realv a, maskv lanes) {
  return (lanes & (abs_v(a) <= FARTHEST)) ? a : (realv)0;
}

static inline void footprint_landing(ray_t *ray, const place_t *place, const scene_t *scene) {
  footprint_t by[2];
  footprint_read(ray, by);
  const real3v normal = broadcast3(scene->picture.normal);
  const real3v dual_s = broadcast3(scene->picture.dual_s), dual_t = broadcast3(scene->picture.dual_t);
  const real3v row = footprint_on_plane(by[0], ray->direction, normal, place->distance);
  const real3v column = footprint_on_plane(by[1], ray->direction, normal, place->distance);
  ray->s_by_row = footprint_number(dot3(dual_s, row), place->meets);
  ray->s_by_column = footprint_number(dot3(dual_s, column), place->meets);
  ray->t_by_row = footprint_number(dot3(dual_t, row), place->meets);
  ray->t_by_column = footprint_number(dot3(dual_t, column), place->meets);
}
