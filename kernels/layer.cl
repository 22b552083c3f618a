// layer.cl: by which set of the scene's numbers a work-item traces, and where its rays go in the arrays.
//
// provides  layer_t        needs  nothing

typedef struct {
  int number;  // of the set of numbers, and of the layer of every array that it fills
  int item;    // which of the layer's work-items
  int start;   // where the layer begins in the arrays, rays
} layer_t;
