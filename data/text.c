#include "data/text.h"
#include "data/file.h"
#include <stdbool.h>
#include <stdlib.h>

ts_code io_text_begin(io_text *t, const char *name, ts_status *st)
{
    *t = (io_text){.f = NULL};
    t->f = open_memstream(&t->bytes, &t->size);
    if (!t->f) return ts_fail(st, TS_NOMEM, "%s: no memory for its text", name);
    t->before = ts_locale_plain();
    return TS_OK;
}

ts_code io_text_end(io_text *t, const char *name, ts_status *st)
{
    const bool bad = ferror(t->f) != 0;
    const bool cut = fclose(t->f) != 0;
    t->f = NULL;
    ts_locale_back(t->before);
    if (!bad && !cut && t->bytes) return TS_OK;
    free(t->bytes);
    t->bytes = NULL;
    return ts_fail(st, TS_NOMEM, "%s: no memory for its text", name);
}

ts_code io_text_write(io_text *t, const char *path, ts_status *st)
{
    ts_code code = io_text_end(t, path, st);
    if (!code) code = io_write_bytes(path, t->bytes, t->size, st);
    free(t->bytes);
    t->bytes = NULL;
    return code;
}
