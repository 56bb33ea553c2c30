/* What lgd-infer is given: photographs, folders of them, and lists. */
#ifndef LGD_OPERANDS_H
#define LGD_OPERANDS_H
#include "tensor/status.h"

typedef struct lgd_operands {
    char **photo;
    int photos, capacity;
    int failed; /* operands without photographs */
} lgd_operands;

/* Each of count operands: a folder stands for the images in it, by their names' endings, in the order of the names,
 * hidden files and folders in it left out; @FILE for the names in that file, one a line, folders too; anything else for
 * itself. What has none, or cannot be read, is reported to failed as one line, and the others are taken. TS_NOMEM. The
 * caller frees. */
ts_code lgd_operands_expand(char *const *operand, int count, void (*failed)(const char *message), lgd_operands *all,
                            ts_status *st);
void lgd_operands_free(lgd_operands *all);
#endif
