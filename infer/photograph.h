/* A photograph as the weights want it. */
#ifndef LGD_PHOTOGRAPH_H
#define LGD_PHOTOGRAPH_H
#include "data/image/image.h"

/* Whether the weights are of the published network (arch.compat, nn/model.h), whose photographs are prepared as its
 * authors' loader does. Only the file's head is read, of a PyTorch file also the tensors that are compressed. */
ts_code lgd_weights_published(const char *path, bool *published, ts_status *st);

/* The photograph's largest centred square at size x size pixels, linear, which the caller frees. published: resampled
 * by io_centre_square_scikit as it is stored (8-bit values / 255) and only then raised to rd_published.gamma; otherwise
 * resampled while linear. threads: of io_read_photo_square. Messages name it. */
ts_code lgd_photograph_square(const char *path, bool published, int64_t max_pixels, int size, int threads,
                              io_image *square, io_photo_facts *facts, ts_status *st);
#endif
