/* Every method on every material of every set. */
#ifndef EV_RUN_H
#define EV_RUN_H
#include "data/camera.h"
#include "eval/estimate.h"
#include "eval/report.h"
#include "eval/sets.h"

typedef struct ev_run {
    const ev_set *set;
    const char *const *set_name;
    int sets;
    ev_estimator *method; /* parsed, not open */
    int methods;
    int size, repeat;
    uint64_t seed;           /* of the renderings' views and the noise */
    double noise, exposure;  /* exposure: true power of the inputs' lights over the power that the methods know */
    rd_view flash;           /* of the first input; not of captures */
    bool fit;                /* compare renderings after one factor is fitted */
    const io_camera *camera; /* of known materials, or NULL: a clean rendering under flash */
    bool light_known;        /* of captures, and where camera is not NULL: the methods know lights and cameras */
    bool perceptual, pictures, pinned; /* SSIM and FLIP; pictures for the report; whether the threads are pinned */
    bool exact;                        /* of every method (ev_estimator) */
    ev_lpips *lpips;                   /* also LPIPS, unless NULL */
    const char *model;                 /* its name for the report */
    const char *images;                /* a folder for sheets, or NULL */
    int shard, shards;                 /* do part shard of 1 .. shards of the materials; shards 0: all */
    void (*failed)(const char *message, void *user); /* of a material; the others go on */
    void (*done)(int64_t done, int64_t total, const char *name, void *user);
    void *user;

    /* After ev_run_all: */
    ev_report report; /* points into what follows */
    int failures;
    ev_subject *subject;
    int *step;
    int inputs; /* pictures of each material: the most that a method reads */
} ev_run;

enum { EV_PICTURES = 256 /* in a report: some 80 MB */ };

/* First opens each method, so that errors in weights show before any work. Then runs one after the other, each with its
 * own memory and caches; the first photograph runs once unmeasured. TS_INTERRUPTED after Ctrl-C. The caller frees the
 * run also after a failure. */
ts_code ev_run_all(ev_run *r, ts_status *st);
void ev_run_free(ev_run *r);
#endif
