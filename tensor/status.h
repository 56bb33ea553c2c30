/* Status and messages. Libraries return a code and write one line of text; only a main.c prints and exits. */
#ifndef TS_STATUS_H
#define TS_STATUS_H
#include <stdarg.h>

typedef enum ts_code {
    TS_OK = 0,
    TS_INVALID,     /* an argument, a shape or a configuration value that makes no sense */
    TS_NOMEM,       /* memory could not be had */
    TS_IO,          /* the operating system refused to open, read, write, sync or rename */
    TS_FORMAT,      /* a file's content is not what it claims to be */
    TS_UNSUPPORTED, /* valid, but nothing here can do it */
    TS_NUMERIC,     /* a value that must be finite is not */
    TS_INTERRUPTED  /* stopped on request */
} ts_code;

typedef struct ts_status {
    ts_code code;
    char message[512]; /* one line, no newline at the end; empty while code is TS_OK */
} ts_status;

/* Sets code and message (printf style) and returns code. st may be NULL: then only the code is returned. */
ts_code ts_fail(ts_status *st, ts_code code, const char *format, ...) __attribute__((format(printf, 3, 4)));

/* Puts "text: " before the message that st holds; nothing happens while st is TS_OK or NULL. Returns st's code. */
ts_code ts_context(ts_status *st, const char *format, ...) __attribute__((format(printf, 2, 3)));
#endif
