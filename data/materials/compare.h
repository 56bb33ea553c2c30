/* Procedural materials beside others', as a table. */
#ifndef IO_COMPARE_H
#define IO_COMPARE_H
#include "data/materials/procedural.h"
#include <stdio.h>

/* Materials first .. first+count-1 of p against those that io_visit_materials finds in the folder: the features of
 * data/materials/statistics.h with the distance of the sets, and quantiles of what data/materials/joint.h measures. */
ts_code io_compare(const io_procedural *p, uint64_t first, int count, const char *folder, int size, FILE *f,
                   ts_status *st);
#endif
