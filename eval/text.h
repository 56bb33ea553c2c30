/* Names in reports. File names are bytes and what is written is UTF-8: tensor/utf8.h. For HTML: data/html.h, for JSON:
 * data/json.h. */
#ifndef EV_TEXT_H
#define EV_TEXT_H
#include <stdio.h>

/* RFC 4180: a field, in quotes when it has to be. */
void ev_csv_field(FILE *f, const char *text);
#endif
