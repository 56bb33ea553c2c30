/* What programs are given: photographs, folders of them, and lists. */
#ifndef CL_OPERANDS_H
#define CL_OPERANDS_H
#include "tensor/status.h"

typedef struct cl_operands {
    char **photo;
    int photos, capacity;
    int failed; /* operands without photographs */
} cl_operands;

/* Each of count operands: a folder stands for the images in it, by their names' endings, in the order of the names,
 * hidden files and folders in it left out; @FILE for the names in that file, which may be a pipe, one a line, folders
 * too,
 * @- for those on standard input; anything else for itself. What has none, or cannot be read, is reported to failed as
 * one line, and the others are taken. TS_NOMEM, TS_INTERRUPTED. The caller frees. */
ts_code cl_operands_expand(char *const *operand, int count, void (*failed)(const char *message), cl_operands *all,
                           ts_status *st);
void cl_operands_free(cl_operands *all);
#endif
