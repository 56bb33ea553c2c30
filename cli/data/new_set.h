/* A folder's set of files that appears when it is complete: it is written into a hidden folder (tensor/new_file.h) and
 * renamed, or its files are where the folder is there already. */
#ifndef CL_NEW_SET_H
#define CL_NEW_SET_H
#include "tensor/status.h"
#include <stdbool.h>

typedef struct cl_new_set {
    char folder[4096];
    char *hidden;     /* where the files are written */
    const char *mark; /* the file without which no reader takes the set; NULL: it has none */
    int lock, moving; /* of the hidden folder; of the folder while files move into it, or -1 */
    bool there;
} cl_new_set;

/* mark is kept. After a failure there is nothing to end. */
ts_code cl_new_set_begin(cl_new_set *s, const char *folder, const char *mark, ts_status *st);
/* Puts count sets in place, their marks last, so that what a killed process leaves of them is not taken for whole. When
 * code is an error, what was written is removed and the old files stay. Returns code, or what was met. */
ts_code cl_new_sets_end(cl_new_set *s, int count, ts_code code, ts_status *st);
#endif
