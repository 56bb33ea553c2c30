/* Names in reports. File names are bytes and what is written is UTF-8: a byte that is no part of a character is written
 * as \xNN with hexadecimal digits, so that names that differ stay different. */
#ifndef EV_TEXT_H
#define EV_TEXT_H
#include <stdio.h>

/* Text for HTML and SVG: & < > " as entities. */
void ev_put_text(FILE *f, const char *text);

/* RFC 4180: a field, in quotes when it has to be. */
void ev_csv_field(FILE *f, const char *text);

/* A string of JSON, with its quotes. */
void ev_json_string(FILE *f, const char *text);
#endif
