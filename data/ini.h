/* INI files: [section], key = value, comments from # or ; (at the start of a line or after a blank), CRLF or LF, an
 * optional UTF-8 byte-order mark. A value may stand in quotation marks, which take comments' signs in it. Any other
 * line, a key outside a section and a repeated key are errors with FILE:LINE. */
#ifndef IO_INI_H
#define IO_INI_H
#include "tensor/status.h"
#include <stdbool.h>
#include <stddef.h>

typedef struct io_ini_entry {
    const char *section, *key, *value; /* trimmed; value may be empty */
    int line;                          /* from 1 */
} io_ini_entry;

typedef struct io_ini {
    char *name, *text;   /* owned: the file's name for messages, and what the entries point into */
    io_ini_entry *entry; /* owned */
    int count;
} io_ini;

/* TS_IO when the file cannot be read, TS_INVALID for its content. On failure ini is empty; the caller frees it after
 * success. */
ts_code io_ini_read(const char *path, io_ini *ini, ts_status *st);
ts_code io_ini_parse(const char *name, const char *text, size_t size, io_ini *ini, ts_status *st);

/* Whether a value has to stand in quotation marks to be read again as it is. */
bool io_ini_needs_quotes(const char *value);
void io_ini_free(io_ini *ini); /* and zeroes the struct */
#endif
