/* Photographs under a printed sheet as a capture that models read. */
#ifndef LGD_SHEET_H
#define LGD_SHEET_H
#include "data/capture.h"
#include "data/rectify/sheet_set.h"

/* The order in which the photographs are of most use: the one that is nearest to straight above, then each time the one
 * whose camera is farthest from those before. order: [set->good], indices into set->photo. */
void lgd_sheet_order(const io_sheet_set *set, int order[IO_SOLVE_MOST]);

/* The windows of the first `most` good photographs in that order (of all where there are fewer), size x size, in the
 * brightness and colour that the models were trained with: as if the first one's light lit the middle of the window as
 * the default flash does; the paper, of IO_SHEET_PAPER, is the measure, and is grey. The caller frees the capture. */
ts_code lgd_sheet_capture(const io_sheet_set *set, int most, int size, int64_t max_pixels, int threads, io_capture *c,
                          ts_status *st);
#endif
