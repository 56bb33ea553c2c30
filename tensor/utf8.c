#include "tensor/utf8.h"
#include <stdio.h>
#include <string.h>

/* No overlong forms, surrogates or values above U+10FFFF (RFC 3629, section 4). */
int ts_utf8(const unsigned char *s, size_t n)
{
    unsigned char c = s[0], lo = 0x80, hi = 0xbf;
    if (c < 0x80) return 1;
    int length = c >= 0xc2 && c <= 0xdf ? 2 : (c & 0xf0) == 0xe0 ? 3 : c >= 0xf0 && c <= 0xf4 ? 4 : 0;
    if (!length || (size_t)length > n) return 0;
    if (c == 0xe0) lo = 0xa0;
    if (c == 0xed) hi = 0x9f;
    if (c == 0xf0) lo = 0x90;
    if (c == 0xf4) hi = 0x8f;
    if (s[1] < lo || s[1] > hi) return 0;
    for (int i = 2; i < length; i++)
        if (s[i] < 0x80 || s[i] > 0xbf) return 0;
    return length;
}

size_t ts_utf8_next(const char *text, char piece[TS_UTF8_PIECE])
{
    const int length = ts_utf8((const unsigned char *)text, strnlen(text, 4));
    if (length > 0) memcpy(piece, text, (size_t)length);
    else snprintf(piece, TS_UTF8_PIECE, "\\x%02X", (unsigned)(unsigned char)*text);
    if (length > 0) piece[length] = 0;
    return length > 0 ? (size_t)length : 1;
}
