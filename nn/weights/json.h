/* A strict reader of JSON text (RFC 8259) for known structures: the caller names what must come next, so that nothing
 * recurses. The first error stays, and everything after it fails. */
#ifndef NN_JSON_H
#define NN_JSON_H
#include "tensor/status.h"
#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

typedef struct json_reader {
    const char *text;
    size_t size, at;
    char *strings; /* the caller's memory for decoded strings, size + 1 bytes are always enough; filled up to used */
    size_t used;
    const char *what; /* for messages: the file */
    ts_status *st;
    bool failed;
} json_reader;

/* Sets the message "WHAT: header, byte AT: PROBLEM" unless one is set. Always false. */
bool json_fail(json_reader *r, const char *problem);
/* Skips white space and takes c; false and an error when something else is there. */
bool json_take(json_reader *r, char c);
/* The same without an error: was it there? */
bool json_try(json_reader *r, char c);
/* A string, decoded into r->strings with a 0 at its end; NULL after an error. Valid UTF-8 without 0 characters. */
const char *json_string(json_reader *r);
/* An integer without sign, fraction or exponent, at most INT64_MAX. */
bool json_integer(json_reader *r, int64_t *value);
/* Only white space is left. */
bool json_end(json_reader *r);

/* Bytes of s as the inside of a JSON string; out may be NULL to measure. Returns the number of bytes, -1 when s is not
 * UTF-8. */
int64_t json_escape(const char *s, char *out);
#endif
