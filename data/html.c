#include "data/html.h"
#include "tensor/utf8.h"
#include <string.h>

void io_put_text(FILE *f, const char *text)
{
    char piece[TS_UTF8_PIECE];
    while (*text) {
        text += ts_utf8_next(text, piece);
        switch (*piece) {
        case '&': fputs("&amp;", f); break;
        case '<': fputs("&lt;", f); break;
        case '>': fputs("&gt;", f); break;
        case '"': fputs("&quot;", f); break;
        default: fputs(piece, f);
        }
    }
}

void io_put_base64(FILE *f, const unsigned char *bytes, size_t size)
{
    static const char letter[] = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    for (size_t i = 0; i < size; i += 3) {
        const size_t left = size - i;
        const unsigned v = (unsigned)bytes[i] << 16 | (left > 1 ? (unsigned)bytes[i + 1] << 8 : 0) |
            (left > 2 ? bytes[i + 2] : 0);
        const char four[4] = {letter[v >> 18], letter[v >> 12 & 63], left > 1 ? letter[v >> 6 & 63] : '=',
                              left > 2 ? letter[v & 63] : '='};
        fwrite(four, 1, 4, f);
    }
}

void io_put_url_part(FILE *f, const char *name)
{
    static const char plain[] = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789-._~";
    for (; *name; name++)
        if (strchr(plain, *name)) fputc(*name, f);
        else fprintf(f, "%%%02X", (unsigned)(unsigned char)*name);
}

void io_put_page(FILE *f, const char *page, const io_slot *slots, void *user)
{
    for (const char *open; (open = strstr(page, "{{"));) {
        const char *name = open + 2, *close = strstr(name, "}}");
        const io_slot *s = slots;
        while (s->name &&
               (!close || strlen(s->name) != (size_t)(close - name) ||
                strncmp(s->name, name, (size_t)(close - name)) != 0))
            s++;
        fwrite(page, 1, (size_t)((s->name ? open : open + 1) - page), f);
        page = s->name ? close + 2 : open + 1;
        if (s->name && s->put) s->put(f, user);
        else if (s->name) fputs(s->text, f);
    }
    fputs(page, f);
}
