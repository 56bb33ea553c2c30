#include "nn/weights/json.h"
#include "tensor/utf8.h"
#include <stdio.h>
#include <string.h>

bool json_fail(json_reader *r, const char *problem)
{
    if (!r->failed) ts_fail(r->st, TS_FORMAT, "%s: header, byte %zu: %s", r->what, r->at, problem);
    r->failed = true;
    return false;
}

static void skip(json_reader *r)
{
    while (r->at < r->size && strchr(" \t\r\n", r->text[r->at]) && r->text[r->at]) r->at++;
}

bool json_try(json_reader *r, char c)
{
    skip(r);
    if (r->failed || r->at >= r->size || r->text[r->at] != c) return false;
    r->at++;
    return true;
}

bool json_take(json_reader *r, char c)
{
    char problem[] = "expected ' '";
    if (json_try(r, c)) return true;
    problem[10] = c;
    return json_fail(r, problem);
}

bool json_end(json_reader *r)
{
    skip(r);
    if (r->at < r->size) json_fail(r, "something follows the end of the JSON text");
    return !r->failed;
}

static bool hex4(json_reader *r, unsigned *code)
{
    *code = 0;
    for (int i = 0; i < 4; i++, r->at++) {
        static const char digits[] = "0123456789abcdef0123456789ABCDEF";
        const char *d = r->at < r->size && r->text[r->at] ? strchr(digits, r->text[r->at]) : NULL;
        if (!d) return json_fail(r, "\\u needs four hexadecimal digits");
        *code = *code * 16 + (unsigned)((d - digits) & 15);
    }
    return true;
}

static bool put_unicode(json_reader *r)
{
    unsigned c, low;
    if (!hex4(r, &c)) return false;
    if (c >= 0xd800 && c <= 0xdfff) {
        bool pair = c <= 0xdbff && r->at + 2 <= r->size && r->text[r->at] == '\\' && r->text[r->at + 1] == 'u';
        if (!pair) return json_fail(r, "half of a surrogate pair");
        r->at += 2;
        if (!hex4(r, &low)) return false;
        if (low < 0xdc00 || low > 0xdfff) return json_fail(r, "half of a surrogate pair");
        c = 0x10000 + ((c - 0xd800) << 10) + (low - 0xdc00);
    }
    if (c == 0) return json_fail(r, "a string holds the character 0");
    char *out = r->strings + r->used;
    int n = 0;
    if (c < 0x80) out[n++] = (char)c;
    else if (c < 0x800) out[n++] = (char)(0xc0 | c >> 6);
    else if (c < 0x10000) {
        out[n++] = (char)(0xe0 | c >> 12);
        out[n++] = (char)(0x80 | (c >> 6 & 0x3f));
    } else {
        out[n++] = (char)(0xf0 | c >> 18);
        out[n++] = (char)(0x80 | (c >> 12 & 0x3f));
        out[n++] = (char)(0x80 | (c >> 6 & 0x3f));
    }
    if (c >= 0x80) out[n++] = (char)(0x80 | (c & 0x3f));
    r->used += (size_t)n;
    return true;
}

const char *json_string(json_reader *r)
{
    static const char escaped[] = "\"\\/bfnrt", plain[] = "\"\\/\b\f\n\r\t";
    skip(r);
    if (r->failed) return NULL;
    if (r->at >= r->size || r->text[r->at] != '"') {
        json_fail(r, "expected a string");
        return NULL;
    }
    char *start = r->strings +
        r->used; /* a decoded string is never longer than its source, and its two quotes make room for the 0 */
    for (r->at++; r->at < r->size;) {
        unsigned char c = (unsigned char)r->text[r->at];
        if (c == '"') {
            r->at++;
            r->strings[r->used++] = 0;
            return start;
        }
        if (c == '\\') {
            char e = r->at + 1 < r->size ? r->text[r->at + 1] : 0;
            const char *found = e ? strchr(escaped, e) : NULL;
            if (found) r->strings[r->used++] = plain[found - escaped];
            else if (e != 'u') {
                json_fail(r, "an escape that JSON does not have");
                return NULL;
            }
            r->at += 2;
            if (!found && !put_unicode(r)) return NULL;
            continue;
        }
        int n = c < 0x20 ? 0 : ts_utf8((const unsigned char *)r->text + r->at, r->size - r->at);
        if (!n) {
            json_fail(r, c < 0x20 ? "a control character in a string" : "not UTF-8");
            return NULL;
        }
        memcpy(r->strings + r->used, r->text + r->at, (size_t)n);
        r->used += (size_t)n;
        r->at += (size_t)n;
    }
    json_fail(r, "a string does not end");
    return NULL;
}

bool json_integer(json_reader *r, int64_t *value)
{
    skip(r);
    if (r->failed) return false;
    size_t first = r->at;
    int64_t v = 0;
    for (; r->at < r->size && r->text[r->at] >= '0' && r->text[r->at] <= '9'; r->at++) {
        int digit = r->text[r->at] - '0';
        if (v > (INT64_MAX - digit) / 10) return json_fail(r, "a number is too large");
        v = v * 10 + digit;
    }
    if (r->at == first) return json_fail(r, "expected an integer that is not negative");
    if (r->text[first] == '0' && r->at > first + 1) return json_fail(r, "a number begins with 0");
    if (r->at < r->size && r->text[r->at] && strchr(".eE+-", r->text[r->at]))
        return json_fail(r, "expected an integer that is not negative");
    *value = v;
    return true;
}

int64_t json_escape(const char *s, char *out)
{
    size_t n = strlen(s);
    int64_t total = 0;
    for (size_t i = 0; i < n;) {
        unsigned char c = (unsigned char)s[i];
        char code[8];
        int length = ts_utf8((const unsigned char *)s + i, n - i), written = length;
        if (!length) return -1;
        if (c == '"' || c == '\\') written = snprintf(code, sizeof code, "\\%c", c);
        else if (c < 0x20) written = snprintf(code, sizeof code, "\\u%04x", c);
        else memcpy(code, s + i, (size_t)length);
        if (out) memcpy(out + total, code, (size_t)written);
        total += written;
        i += (size_t)length;
    }
    return total;
}
