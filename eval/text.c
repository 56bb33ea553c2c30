#include "eval/text.h"
#include "tensor/utf8.h"
#include <stdbool.h>
#include <string.h>

void ev_csv_field(FILE *f, const char *text)
{
    char piece[TS_UTF8_PIECE];
    const bool quoted = strpbrk(text, ",\"\r\n") != NULL;
    if (quoted) fputc('"', f);
    while (*text) {
        text += ts_utf8_next(text, piece);
        if (*piece == '"') fputc('"', f);
        fputs(piece, f);
    }
    if (quoted) fputc('"', f);
}
