#include "nn/weights/text.h"
#include <stdlib.h>
#include <string.h>

char *nn_text_extend(nn_text *t, size_t n)
{
    if (t->failed) return NULL;
    if (t->size - t->used < n) {
        size_t size = (t->size + n) * 2;
        char *data = realloc(t->data, size);
        if (!data) {
            t->failed = true;
            return NULL;
        }
        t->data = data;
        t->size = size;
    }
    t->used += n;
    return t->data + t->used - n;
}

void nn_text_bytes(nn_text *t, const void *data, size_t n)
{
    char *to = n ? nn_text_extend(t, n) : NULL;
    if (to) memcpy(to, data, n);
}

void nn_text_put(nn_text *t, const char *s) { nn_text_bytes(t, s, strlen(s)); }

void nn_text_number(nn_text *t, uint64_t v, int bytes)
{
    char *to = nn_text_extend(t, (size_t)bytes);
    for (int i = 0; to && i < bytes; i++) to[i] = (char)(v >> 8 * i);
}
