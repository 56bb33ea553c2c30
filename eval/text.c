#include "eval/text.h"
#include "nn/weights/json.h"
#include <stdbool.h>
#include <string.h>

enum { PIECE = 5 };

/* The next character of text, which is not at its end. Returns how many bytes of text it is. */
static size_t next_character(const char *text, char piece[PIECE])
{
    const int length = json_utf8((const unsigned char *)text, strnlen(text, 4));
    if (length > 0) memcpy(piece, text, (size_t)length);
    else snprintf(piece, PIECE, "\\x%02X", (unsigned)(unsigned char)*text);
    if (length > 0) piece[length] = 0;
    return length > 0 ? (size_t)length : 1;
}

void ev_put_text(FILE *f, const char *text)
{
    char piece[PIECE];
    while (*text) {
        text += next_character(text, piece);
        switch (*piece) {
        case '&': fputs("&amp;", f); break;
        case '<': fputs("&lt;", f); break;
        case '>': fputs("&gt;", f); break;
        case '"': fputs("&quot;", f); break;
        default: fputs(piece, f);
        }
    }
}

void ev_csv_field(FILE *f, const char *text)
{
    char piece[PIECE];
    const bool quoted = strpbrk(text, ",\"\r\n") != NULL;
    if (quoted) fputc('"', f);
    while (*text) {
        text += next_character(text, piece);
        if (*piece == '"') fputc('"', f);
        fputs(piece, f);
    }
    if (quoted) fputc('"', f);
}

void ev_json_string(FILE *f, const char *text)
{
    char piece[PIECE];
    fputc('"', f);
    while (*text) {
        text += next_character(text, piece);
        for (const char *c = piece; *c; c++) {
            if (*c == '"' || *c == '\\') fprintf(f, "\\%c", *c);
            else if ((unsigned char)*c < 0x20) fprintf(f, "\\u%04x", (unsigned)*c);
            else fputc(*c, f);
        }
    }
    fputc('"', f);
}
