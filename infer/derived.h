/* The maps that are computed from the estimated ones: height, occlusion, base colour and metalness. */
#ifndef LGD_DERIVED_H
#define LGD_DERIVED_H
#include "data/material.h"
#include "infer/order.h"

enum { LGD_DERIVED = LGD_OUT_HEIGHT | LGD_OUT_AO | LGD_OUT_ORM | LGD_OUT_BASECOLOR | LGD_OUT_METALLIC };

/* Each empty where it is not needed. */
typedef struct lgd_derived {
    const io_material *m; /* the caller's */
    io_image height, occlusion, base, metal;
} lgd_derived;

/* Computes what those of which (bits of LGD_DERIVED) take, on so many threads (0: the process's number). facts gets
 * what base colour and metalness cannot express. d is released with lgd_derived_free, after a failure too. */
ts_code lgd_derive(const io_material *m, unsigned which, bool repeats, int threads, lgd_derived *d,
                   lgd_output_result *facts, ts_status *st);
/* Those of which into the folder, by lgd_files' names. facts gets the heights' range. */
ts_code lgd_write_derived(const char *folder, lgd_derived *d, unsigned which, lgd_output_result *facts, ts_status *st);
void lgd_derived_free(lgd_derived *d);
#endif
