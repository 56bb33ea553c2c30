#include "tensor/status.h"
#include <stdio.h>
#include <string.h>

enum { LONGEST = 1 << 13 }; /* two paths and some words */

/* One line. What is too long for a message loses its middle: the file is named at its beginning, what is wrong at its
 * end. */
static void put(ts_status *st, char *text)
{
    for (char *p = text; *p; p++)
        if (*p == '\n' || *p == '\r') *p = ' ';
    static const char gap[] = " ... ";
    const size_t size = strlen(text), room = sizeof st->message - 1, begin = room / 2 - sizeof gap;
    if (size <= room) {
        memcpy(st->message, text, size + 1);
        return;
    }
    const size_t end = room - begin - (sizeof gap - 1);
    memcpy(st->message, text, begin);
    memcpy(st->message + begin, gap, sizeof gap - 1);
    memcpy(st->message + begin + sizeof gap - 1, text + size - end, end + 1);
}

ts_code ts_fail(ts_status *st, ts_code code, const char *format, ...)
{
    if (!st) return code;
    /* The arguments may point into the old message. */
    char text[LONGEST];
    va_list args;
    va_start(args, format);
    vsnprintf(text, sizeof text, format, args);
    va_end(args);
    st->code = code;
    put(st, text);
    return code;
}

ts_code ts_context(ts_status *st, const char *format, ...)
{
    if (!st || st->code == TS_OK) return st ? st->code : TS_OK;
    char text[LONGEST];
    va_list args;
    va_start(args, format);
    const int used = vsnprintf(text, sizeof text - sizeof st->message, format, args);
    va_end(args);
    char *end = used < 0 ? text : text + strlen(text);
    snprintf(end, (size_t)(text + sizeof text - end), ": %s", st->message);
    put(st, text);
    return st->code;
}
