/* JSON that is written. */
#ifndef IO_JSON_H
#define IO_JSON_H
#include <stdio.h>

/* A string, with its quotes; what is not UTF-8 as tensor/utf8.h has it. */
void io_put_json(FILE *f, const char *text);
/* A number with nine digits; null where it is not finite. */
void io_put_json_number(FILE *f, double v);
#endif
