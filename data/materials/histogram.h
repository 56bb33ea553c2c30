/* Histograms of every map over a set of materials, each material weighing the same; two sets compared as numbers and as
 * a picture. */
#ifndef IO_HISTOGRAM_H
#define IO_HISTOGRAM_H
#include "data/materials/statistics.h"

/* Of each of io_values, which lie in [0, 1]. */
enum { IO_HISTOGRAMS = IO_VALUES, IO_BINS = 32 };
const char *io_histogram_name(int histogram);

typedef struct io_histogram {
    int count;                            /* materials */
    double share[IO_HISTOGRAMS][IO_BINS]; /* sums over the materials of the share of their pixels in each bin */
} io_histogram;

void io_histogram_add(io_histogram *h, const float *maps, int size);
/* Adds what io_visit_materials finds in the folder; TS_IO when that is nothing. */
ts_code io_histogram_folder(const char *folder, int size, io_histogram *h, ts_status *st);
/* The overlap of the two sets for one map: the sum over the bins of the smaller share, 1 when they are the same. */
double io_histogram_overlap(const io_histogram *a, const io_histogram *b, int histogram);

/* "map,from,to,A,B" and a line for each bin, shares that add up to 1. */
ts_code io_histogram_csv(const char *path, const io_histogram *a, const io_histogram *b, const char *name_a,
                         const char *name_b, ts_status *st);
/* A panel for each map, a filled and b as an outline. */
ts_code io_histogram_svg(const char *path, const io_histogram *a, const io_histogram *b, const char *name_a,
                         const char *name_b, ts_status *st);
#endif
