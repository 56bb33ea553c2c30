/* Inside data only: the filter of scikit-image's transform.resize along one axis (data/image/image.h). */
#ifndef IO_RESIZE_SCIKIT_H
#define IO_RESIZE_SCIKIT_H
#include "tensor/resample.h"

/* Lives in the arena; weight is NULL where memory was out. */
ts_taps io_taps_scikit(ts_arena *arena, int in, int out);
#endif
