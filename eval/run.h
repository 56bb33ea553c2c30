/* Every method on every material of every set. */
#ifndef EV_RUN_H
#define EV_RUN_H
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
    uint64_t seed;          /* of the renderings' views and the noise */
    double noise, exposure; /* exposure: the inputs' lights, in those that the methods are told; not 1: renderings are
                               compared after one factor is fitted */
    rd_view flash;          /* of the first input, as the methods are told; not of captures */
    bool fit;               /* compare renderings after one factor is fitted */
    bool told;              /* of captures: the methods are told their lights and cameras */
    bool perceptual, pictures, pinned; /* SSIM and FLIP; pictures for the report; whether the threads are pinned */
    ev_lpips *lpips;                   /* LPIPS too, where it is not NULL */
    const char *model;                 /* its name for the report */
    const char *images;                /* a folder for sheets, or NULL */
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

/* Opens each method to learn of its weights' errors before any work, then one after the other, so that its memory and
 * caches are its own; the first photograph is begun once unmeasured. TS_INTERRUPTED after Ctrl-C. The caller frees the
 * run also after a failure. */
ts_code ev_run_all(ev_run *r, ts_status *st);
void ev_run_free(ev_run *r);
#endif
