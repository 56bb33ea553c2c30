/* A photograph on its way, and what is known of it so far. */
#ifndef CL_ITEM_H
#define CL_ITEM_H
#include "cli/infer/plan.h"
#include "data/material.h"
#include "infer/angle.h"
#include "infer/capture.h"
#include "infer/lgd.h"
#include "infer/order.h"
#include "infer/sheet.h"
#include <stdint.h>

/* Why maps may mean little; a bit each in the order of cl_warning_names. */
enum {
    CL_WARN_BLACK = 1 << 0,      /* the photograph is black */
    CL_WARN_FULL = 1 << 1,       /* more than nine tenths of its values are overexposed */
    CL_WARN_FOV = 1 << 2,        /* its field of view is assumed */
    CL_WARN_PROFILE = 1 << 3,    /* its colour profile cannot be used */
    CL_WARN_MASK = 1 << 4,       /* the mask is black all over */
    CL_WARN_DIFFERENT = 1 << 5,  /* the maps do not look like it: a difference above CL_FAR */
    CL_WARN_TRANSPARENT = 1 << 6 /* it is transparent somewhere: black is taken there */
};
enum { CL_WARNINGS = 7 };
extern const char *const cl_warning_names[CL_WARNINGS];
/* Reconstruction RMSE from which the difference is seen. Of 32 photographs by others (docs/real.md) the default model
 * leaves one beyond it, whose highlights are missing. */
#define CL_FAR 0.05

typedef struct cl_item {
    const cl_job *job;
    int index;                /* into the plan */
    uint64_t hash;            /* of the photograph's file (tensor/hash.h); of a capture 0 */
    ts_status st;             /* the first failure on the way; later stages leave the item alone */
    float *square;            /* linear, [size][size][3], or NULL: of a capture or a sheet */
    lgd_rectified angle;      /* with corners; its square's values are item->square */
    io_capture capture;       /* images 0: there is none */
    io_sheet_set sheet;       /* with --sheet: what was found in each photograph; capture has the windows */
    const float *image;       /* the photograph, or the first of the capture: in one of these; NULL: not read */
    unsigned char *mask;      /* [size][size] from command->mask, or NULL */
    double fov;               /* of the photograph, in degrees across the square; LGD_FOV_UNKNOWN, LGD_FOV_OF_PHOTO */
    char fov_from[192];       /* where it is known from, or why it is not */
    char profile[96];         /* io_photo_facts.profile */
    bool transparent;         /* io_photo_facts.transparent */
    io_capture_source source; /* of a photograph: without a file; of a capture or a sheet: see cl_item_source */
    lgd_photo photo[IO_CAPTURE_IMAGES];
    double ambient;     /* light beside the flash's that was found */
    int photos;         /* of these, the ones that the weights read */
    io_material m;      /* in the encoding of tensor/maps.h */
    double first, last; /* reconstruction RMSE of R_0 and of the last R_t */
    int steps;          /* t of that */
    double power;       /* of the light that was taken, in those that the photographs name */
    lgd_output_result written;
    bool replaced;     /* the maps of another photograph were in its folder */
    bool was_done;     /* its folder was complete already: nothing is read, estimated or written */
    char *result;      /* members for results.jsonl (cli/infer/record.h), once there are complete files */
    unsigned warnings; /* CL_WARN_ */
    double seconds;    /* of reading, estimating and writing */
    int threads;       /* to compute and write it on, the calling thread's own (tensor/threads.h) */
    double shown;      /* the progress function's: how much of it the progress bar has, 0 .. 1 */
    int stage;         /* the pipeline's */
} cl_item;

/* Of an estimated item: "assumed: " where its field of view is the default, "estimated: " where the model guessed it,
 * or "". */
const char *cl_item_assumption(const cl_item *item);
/* "known", "estimated" or "assumed". */
const char *cl_item_fov_is(const cl_item *item);
/* The photographs whose maps these are, and the file of each. */
int cl_item_sources(const cl_item *item);
const io_capture_source *cl_item_source(const cl_item *item, int k);
const char *cl_item_file(const cl_item *item, int k);
/* CL_WARN_BLACK, CL_WARN_FULL or 0. */
unsigned cl_item_light(const io_levels *levels);
/* Before the next photograph: all but the maps, whose memory it writes again. */
void cl_item_clear(cl_item *item);
void cl_item_free(cl_item *item);
#endif
