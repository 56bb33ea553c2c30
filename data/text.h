/* A text that is printed into memory, to be written as one file. Printing says nothing of what failed: the end does.
 * Between begin and end, which one thread calls, numbers have a decimal point whatever the user's language. */
#ifndef IO_TEXT_H
#define IO_TEXT_H
#include "tensor/plain_locale.h"
#include "tensor/status.h"
#include <stdio.h>

typedef struct io_text {
    FILE *f; /* what is printed to, between begin and end */
    char *bytes;
    size_t size;
    locale_t before; /* the thread's */
} io_text;

/* name: what the message of a failure begins with. After a failure there is nothing to end. */
ts_code io_text_begin(io_text *t, const char *name, ts_status *st);
/* t->bytes is the whole text with a zero byte behind it, the caller's to free; TS_NOMEM and NULL where any of it is
 * missing. */
ts_code io_text_end(io_text *t, const char *name, ts_status *st);
/* Ends it and writes the file path. */
ts_code io_text_write(io_text *t, const char *path, ts_status *st);
#endif
