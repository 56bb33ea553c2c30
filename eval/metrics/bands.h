/* How alike two materials' normals are, scale by scale. */
#ifndef EV_BANDS_H
#define EV_BANDS_H
#include "tensor/status.h"
#include <stdbool.h>

/* Band k: spatial frequencies from ev_band[k] to ev_band[k + 1], in cycles a patch. */
enum { EV_BANDS = 4 };
extern const int ev_band[EV_BANDS + 1];
#define EV_LEAST_RELIEF 0.005 /* RMS of normals that can be seen */

/* Correlation of n_x and n_y of maps [size, size, channels] with those of truth in each band: 1 for the truth, 0 for
 * what has nothing in the band; NaN where the truth has too little to see (RMS under EV_LEAST_RELIEF), or the size is
 * too small for it. The patch is taken as periodic. False: memory cannot be had. */
bool ev_band_correlation(int size, const float *maps, int channels, const float *truth, int truth_channels,
                         double correlation[EV_BANDS]);
#endif
