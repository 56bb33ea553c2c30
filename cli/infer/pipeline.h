/* Many photographs: several at once, each computed and written on threads of its own, while the next are decoded. */
#ifndef LGD_PIPELINE_H
#define LGD_PIPELINE_H
#include "data/material.h"
#include "data/metallic.h"
#include "infer/capture.h"
#include "cli/infer/options.h"
#include "cli/infer/plan.h"

/* A photograph on its way. */
typedef struct lgd_item {
    const lgd_job *job;
    int index;           /* into the plan */
    ts_status st;        /* the first failure on the way; later stages leave the item alone */
    io_image square;     /* linear, command->size a side; of a capture the first picture */
    io_capture capture;  /* images 0: there is none */
    unsigned char *mask; /* [size][size] from command->mask, or NULL */
    int photo_side;      /* the shorter side of the photograph in pixels */
    io_material m;
    double first, last;     /* reconstruction RMSE of R_0 and of the last R_t */
    int steps;              /* t of that */
    double power;           /* of the light that was taken, in those that the photographs name */
    io_metallic_error lost; /* infer/output.h */
    int threads;            /* to compute and write it on, the calling thread's own (tensor/threads.h) */
    double shown;           /* the computing function's: how much of it the progress bar has, 0 .. 1 */
    int stage;              /* the pipeline's own */
} lgd_item;

typedef struct lgd_pipeline lgd_pipeline;

/* Starts decoding at once, in the plan's order, published: as infer/photograph.h says; plan and command outlive the
 * pipeline. NULL with st on failure. */
lgd_pipeline *lgd_pipeline_start(const lgd_plan *plan, const lgd_command *command, bool published, ts_status *st);

/* Computes the maps of an item, or sets its st. Called by several threads at once, each time for another item. */
typedef void (*lgd_compute)(lgd_item *item, void *user);
/* Told of every photograph in the plan's order, when its files are complete or its st says why not, by the thread that
 * calls lgd_pipeline_run. */
typedef void (*lgd_finished)(const lgd_item *item, void *user);

/* stop is asked before each photograph, by any of the threads: true ends the work after what is being computed and
 * written; the photographs that were decoded and not computed end with TS_INTERRUPTED. Once for a pipeline. */
void lgd_pipeline_run(lgd_pipeline *p, lgd_compute compute, lgd_finished finished, bool (*stop)(void), void *user);

/* Waits for what is under way. Nulls the pointer. */
void lgd_pipeline_end(lgd_pipeline **p);
#endif
