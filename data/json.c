#include "data/json.h"
#include "tensor/utf8.h"
#include <math.h>

void io_put_json(FILE *f, const char *text)
{
    char piece[TS_UTF8_PIECE];
    fputc('"', f);
    while (*text) {
        text += ts_utf8_next(text, piece);
        for (const char *c = piece; *c; c++) {
            if (*c == '"' || *c == '\\') fprintf(f, "\\%c", *c);
            else if ((unsigned char)*c < 0x20) fprintf(f, "\\u%04x", (unsigned)*c);
            else fputc(*c, f);
        }
    }
    fputc('"', f);
}

void io_put_json_number(FILE *f, double v)
{
    if (isfinite(v)) fprintf(f, "%.9g", v);
    else fputs("null", f);
}
