/* The architecture's fields as a table, for those who write it down: weights files (nn/weights) and configurations. */
#ifndef NN_ARCH_FIELDS_H
#define NN_ARCH_FIELDS_H
#include "nn/model.h"
#include <stddef.h>

typedef enum nn_field_kind { FIELD_INT, FIELD_BOOL, FIELD_WORD } nn_field_kind;

typedef struct nn_arch_field {
    const char *key;
    nn_field_kind kind;
    size_t at; /* of the member in nn_arch */
    int lo, hi, start;
    const char *const *words; /* FIELD_WORD: its values' names, lo .. hi */
    bool late;                /* files older than the field do not have it */
} nn_arch_field;

enum { NN_ARCH_FIELDS = 31 };
extern const nn_arch_field nn_arch_fields[NN_ARCH_FIELDS];

int nn_arch_get(const nn_arch *a, const nn_arch_field *f);
void nn_arch_set(nn_arch *a, const nn_arch_field *f, int v); /* v within lo .. hi */
#endif
