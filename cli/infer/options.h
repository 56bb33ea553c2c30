/* The command line of lgd-infer. */
#ifndef CL_OPTIONS_H
#define CL_OPTIONS_H
#include "cli/arguments.h"
#include "infer/angle.h"
#include "infer/lgd.h"
#include <stdbool.h>
#include <stdint.h>

typedef struct cl_command {
    const char *out, *model, *mask;
    char capture[4096]; /* what is read in place of a photograph, without slashes at its end; or empty */
    int size, iterations /* -1: lgd_usual_iterations; LGD_AUTO */, threads;
    int64_t max_pixels;
    double max_memory; /* bytes; 0: tensor/budget.h's default */
    double tolerance;
    int orientations;  /* 1, 2, 4 or 8; 0: LGD_ORIENTATIONS_DEFAULT */
    int sample;        /* LGD_SAMPLE_... */
    double fov;        /* degrees across the square, with corners across the shorter side; 0: from the file */
    io_corners angle;  /* of the square in the photograph, where corners is true */
    double power;      /* of the light, in default ones; 0: estimated */
    unsigned outputs;  /* LGD_OUT_... */
    int shard, shards; /* of the photographs the part shard of 1 .. shards; 0: all */
    bool skip_existing, directx, metallic, seamless, half /* of maps.exr */, exact, bf16, quiet, help, version, corners,
        sheet;    /* the photographs are of one sample under a printed sheet, one result */
    char **photo; /* into argv; with a capture, that alone; with a sheet, all are one result's */
    char *only[1];
    int photos;
} cl_command;

extern const cl_argument cl_infer_arguments[];

/* TS_INVALID and st on wrong usage. With help or version set nothing else is checked. */
ts_code cl_command_parse(int argc, char **argv, cl_command *c, ts_status *st);

/* Whether the maps are of one file: not of a capture or of photographs of a sheet. */
bool cl_command_one_file(const cl_command *c);

/* Refinement steps of so many photographs of one sample, at most. */
int cl_command_steps(const cl_command *c, const lgd_model *model, int photos);
#endif
