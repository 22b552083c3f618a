// film.cl: where the rays of a tile pass through the film.
//
// provides  film_points(), in_tile()
// needs     prelude; film_t { corner, column_step, row_step }
//
// A tile is a rectangle of film pixels, traced by one launch:
//
//   tile.x  first row     tile.y  first column     tile.z  columns of the tile     tile.w  pixels of the tile
//
// Its pixels are numbered row by row. They are at most 2^20, so that in single precision, too, (pixel + 1/2) / columns
// never rounds across a whole number: the next is 1 / (2 columns) away, and a reciprocal of 2.5 ulp, all that OpenCL
// promises, and a product err by a quarter of that.

// Pixel (row, column) of the film has its centre at corner + (column + 1/2) column_step + (row + 1/2) row_step. Returns
// the centres of a packet's pixels, from the tile's pixel first on, as seen from a point.
static inline real3v film_points(const film_t *film, int4 tile, int first, const real *from) {
  const real half_pixel = NUMBER(0.5);
  const int first_row = first / tile.z, first_column = first - first_row * tile.z;
  realv row = (realv)(real)first_row, column = (realv)(real)first_column + LANES;

  // Go on in the next rows where the packet is longer than what is left of this one
  if (first_column + VW > tile.z) {
    const realv columns = (realv)(real)tile.z;
    const realv rows = floor((column + half_pixel) * ((realv)1 / columns));
    row += rows;
    column -= rows * columns;
  }
  row += (real)tile.x + half_pixel;
  column += (real)tile.y + half_pixel;
  const real3v point = {
      (realv)(film->corner[0] - from[0]) + row * film->row_step[0] + column * film->column_step[0],
      (realv)(film->corner[1] - from[1]) + row * film->row_step[1] + column * film->column_step[1],
      (realv)(film->corner[2] - from[2]) + row * film->row_step[2] + column * film->column_step[2]};
  return point;
}

// The lanes of the packet from pixel first on that are pixels of the tile.
static inline maskv in_tile(int4 tile, int first) { return LANES < (realv)(real)(tile.w - first); }
