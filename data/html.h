/* HTML pages: templates whose {{slots}} are filled in, and what goes into them. */
#ifndef IO_HTML_H
#define IO_HTML_H
#include <stddef.h>
#include <stdio.h>

/* Text for HTML and SVG: & < > " as entities, what is not UTF-8 as tensor/utf8.h has it. */
void io_put_text(FILE *f, const char *text);
/* A file's name in a relative address: the unreserved characters of RFC 3986, the other bytes as %XX. */
void io_put_url_part(FILE *f, const char *name);
void io_put_base64(FILE *f, const unsigned char *bytes, size_t size); /* RFC 4648 */

/* What stands for {{name}} in a template: text as it is, or what put writes. */
typedef struct io_slot {
    const char *name, *text;
    void (*put)(FILE *f, void *user);
} io_slot;

/* The template with its slots filled; what fills one is not looked into. slots: ends with a name NULL. A slot that is
 * not in the list stays as it is. The caller looks at f's errors. */
void io_put_page(FILE *f, const char *page, const io_slot *slots, void *user);
#endif
