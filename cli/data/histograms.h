/* Histograms of procedural materials beside those of others' (data/materials/histogram.h), as files. */
#ifndef CL_HISTOGRAMS_H
#define CL_HISTOGRAMS_H
#include "data/materials/procedural.h"

/* Writes output/histograms.csv and output/histograms.svg: materials first .. first+count-1 of p, at size x size pixels,
 * beside all that io_visit_materials finds in testdata. Prints to stdout how much of each map's histogram the two have
 * in common. Ends with TS_INTERRUPTED after Ctrl-C. */
ts_code cl_write_histograms(const char *output, const io_procedural *p, uint64_t first, int count, const char *testdata,
                            int size, ts_status *st);
#endif
