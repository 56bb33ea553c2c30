/* Text from outside, which may be any bytes. */
#ifndef TS_UTF8_H
#define TS_UTF8_H
#include <stddef.h>

/* Length of the UTF-8 character at s (n > 0 bytes are there), 0 when it is not one. */
int ts_utf8(const unsigned char *s, size_t n);

/* The next character of text, which is not at its end, with a 0 behind it; a byte that is no part of one as \xNN with
 * hexadecimal digits, so that texts that differ stay different. Returns how many bytes of text it is. */
enum { TS_UTF8_PIECE = 5 };
size_t ts_utf8_next(const char *text, char piece[TS_UTF8_PIECE]);
#endif
