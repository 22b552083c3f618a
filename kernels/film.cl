// film.cl: where the rays of a tile pass through the film.
//
// provides  film_points()
// needs     prelude; film_t { corner, right, down, columns, rows }
//
// A tile is a rectangle of film pixels, traced by one launch:
//
//   tile.x  first row     tile.y  first column     tile.z  columns of the tile     tile.w  pixels of the tile
//
// Its pixels are numbered row by row. They are at most 2^22, so that in single precision, too, (pixel + 1/2) / columns
// never rounds across a whole number: the distance to the next is 1 / (2 columns), more than the quotient's half ulp.

// Pixel (row, column) of the film has its centre at corner + right (column + 1/2) / columns + down (row + 1/2) / rows.
static inline real3v film_points(const film_t *film, int4 tile, realv pixel) {
  const realv tile_columns = (realv)(real)tile.z;
  const realv tile_row = floor((pixel + (realv)NUMBER(0.5)) / tile_columns);
  const realv column = pixel - tile_row * tile_columns + (realv)(real)tile.y;
  const realv row = tile_row + (realv)(real)tile.x;

  const realv s = (column + (realv)NUMBER(0.5)) / (realv)film->columns;
  const realv t = (row + (realv)NUMBER(0.5)) / (realv)film->rows;
  return at3(at3(broadcast3(film->corner), broadcast3(film->right), s), broadcast3(film->down), t);
}
