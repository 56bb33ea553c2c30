#include "tensor/status.h"
#include <stdio.h>
#include <string.h>

ts_code ts_fail(ts_status *st, ts_code code, const char *format, ...)
{
    if (!st) return code;
    /* The arguments may point into the old message. */
    char text[sizeof st->message];
    va_list args;
    va_start(args, format);
    vsnprintf(text, sizeof text, format, args);
    va_end(args);
    for (char *p = text; *p; p++)
        if (*p == '\n' || *p == '\r') *p = ' ';
    st->code = code;
    memcpy(st->message, text, sizeof text);
    return code;
}

ts_code ts_context(ts_status *st, const char *format, ...)
{
    if (!st || st->code == TS_OK) return st ? st->code : TS_OK;
    char text[sizeof st->message], old[sizeof st->message];
    va_list args;
    va_start(args, format);
    vsnprintf(text, sizeof text, format, args);
    va_end(args);
    memcpy(old, st->message, sizeof old);
    /* What does not fit is cut at the end: the context, which names the file, comes first. */
    size_t used = 0;
    for (const char *part = text; *part && used + 1 < sizeof st->message; part++) st->message[used++] = *part;
    for (const char *part = ": "; *part && used + 1 < sizeof st->message; part++) st->message[used++] = *part;
    for (const char *part = old; *part && used + 1 < sizeof st->message; part++) st->message[used++] = *part;
    st->message[used] = 0;
    return st->code;
}
