// film.cl: where the rays of a tile pass through the film.
//
// provides  film_points()
// needs     prelude; film_t { corner, column_step, row_step }
//
// A tile is a rectangle of film pixels, traced by one launch:
//
//   tile.x  first row     tile.y  first column     tile.z  columns of the tile     tile.w  pixels of the tile
//
// Its pixels are numbered row by row. They are at most 2^20, so that in single precision, too, (pixel + 1/2) / columns
// never rounds across a whole number: the next is 1 / (2 columns) away, and a reciprocal of 2.5 ulp, all that OpenCL
// promises, and a product err by a quarter of that.

// Pixel (row, column) of the film has its centre at corner + (column + 1/2) column_step + (row + 1/2) row_step.
static inline real3v film_points(const film_t *film, int4 tile, realv pixel) {
  const real columns = (real)tile.z;
  const realv half_pixel = (realv)NUMBER(0.5);
  const realv row = floor((pixel + half_pixel) * ((real)1 / columns));
  const realv column = pixel - row * columns;

  const real3v in_row = at3(broadcast3(film->corner), broadcast3(film->row_step), row + ((real)tile.x + half_pixel));
  return at3(in_row, broadcast3(film->column_step), column + ((real)tile.y + half_pixel));
}
