/* index.html: the materials of a call, each with a link to its page. */
#ifndef CL_INDEX_H
#define CL_INDEX_H
#include "cli/infer/item.h"
#include "data/text.h"

#define CL_INDEX_NAME "index.html"

typedef struct cl_index {
    io_text cards; /* of what was added; cards.f NULL: no index is wanted, and the functions do nothing */
    int materials, failed;
} cl_index;

/* TS_INVALID where folder/index.html would replace one of the plan's photographs, or is where a folder is or will be.
 * The caller ends the index after success. */
ts_code cl_index_start(cl_index *index, const cl_plan *plan, const char *folder, ts_status *st);
/* A finished item, with its photograph and a rendering, of the first five hundred that this call has made; of a failed
 * one its message. */
ts_code cl_index_add(cl_index *index, const cl_item *item, ts_status *st);
/* Writes folder/index.html, one file whose pictures are in it, unless nothing was added or st has a failure
 * already. Frees the index. */
ts_code cl_index_end(cl_index *index, const char *folder, ts_status *st);
#endif
