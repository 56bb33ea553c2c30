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

void ev_json_string(FILE *f, const char *text)
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
