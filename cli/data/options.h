/* What lgd-data is asked for. */
#ifndef CLI_DATA_OPTIONS_H
#define CLI_DATA_OPTIONS_H
#include "cli/camera.h"
#include "data/materials/procedural.h"

typedef enum cl_format {
    CL_FORMAT_NONE,
    CL_FORMAT_FOLDERS,
    CL_FORMAT_STRIPS,
    CL_FORMAT_CAPTURES,
    CL_FORMAT_SHEETS
} cl_format;

typedef struct cl_data_options {
    const char *output, *testdata, *collection;
    io_procedural procedural;
    int64_t first, count, size, threads, quality, width; /* count and size 0: not given */
    io_camera camera;
    cl_format format;
    bool sheet, photographs, statistics, histograms;
} cl_data_options;

/* Reads the command line over o, which holds the defaults; --help and --version end the process. CL_OK, or CL_USAGE
 * with a line on standard error. */
int cl_data_options_read(int argc, char **argv, cl_data_options *o);
#endif
