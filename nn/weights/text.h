/* A growing buffer for headers and directories. The first failure stays. */
#ifndef NN_TEXT_H
#define NN_TEXT_H
#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

typedef struct nn_text {
    char *data; /* the owner frees it */
    size_t used, size;
    bool failed; /* no memory */
} nn_text;

/* n more bytes, to be filled; NULL when there is no memory. */
char *nn_text_extend(nn_text *t, size_t n);
void nn_text_bytes(nn_text *t, const void *data, size_t n);
void nn_text_put(nn_text *t, const char *s);
/* The lowest bytes of v, little endian. */
void nn_text_number(nn_text *t, uint64_t v, int bytes);
#endif
