/* The INI reader. */
#include "data/ini.h"
#include <errno.h>
#include <stdbool.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { LARGEST = 1 << 20 }; /* bytes; more is not a configuration */

static bool blank(char c) { return c == ' ' || c == '\t' || c == '\r'; }

/* Cuts blanks off both ends, in place. */
static char *trim(char *s)
{
    while (blank(*s)) s++;
    size_t n = strlen(s);
    while (n > 0 && blank(s[n - 1])) s[--n] = 0;
    return s;
}

/* What stands between quotation marks behind the equals sign has no comment. */
static void cut_comment(char *line)
{
    char *value = strchr(line, '=');
    if (value)
        for (value++; blank(*value);) value++;
    char *quoted = value && *value == '"' ? strchr(value + 1, '"') : NULL;
    for (char *p = line; *p; p++)
        if (p == value && quoted) p = quoted;
        else if ((*p == '#' || *p == ';') && (p == line || blank(p[-1]))) {
            *p = 0;
            return;
        }
}

static bool is_name(const char *s)
{
    if (!*s) return false;
    for (; *s; s++)
        if (!((*s >= 'a' && *s <= 'z') || (*s >= 'A' && *s <= 'Z') || (*s >= '0' && *s <= '9') || *s == '_'))
            return false;
    return true;
}

static ts_code add(io_ini *ini, int *capacity, io_ini_entry e, ts_status *st)
{
    for (int i = 0; i < ini->count; i++)
        if (!strcmp(ini->entry[i].section, e.section) && !strcmp(ini->entry[i].key, e.key))
            return ts_fail(st, TS_INVALID, "%s:%d: %s.%s is given twice (first in line %d)", ini->name, e.line,
                           e.section, e.key, ini->entry[i].line);
    if (ini->count == *capacity) {
        const int more = *capacity ? 2 * *capacity : 64;
        io_ini_entry *grown = realloc(ini->entry, (size_t)more * sizeof *grown);
        if (!grown) return ts_fail(st, TS_NOMEM, "%s: out of memory", ini->name);
        ini->entry = grown;
        *capacity = more;
    }
    ini->entry[ini->count++] = e;
    return TS_OK;
}

static ts_code parse_line(io_ini *ini, int *capacity, char *line, int number, const char **section, ts_status *st)
{
    cut_comment(line);
    char *s = trim(line);
    if (!*s) return TS_OK;
    if (*s == '[') {
        char *end = strchr(s, ']');
        if (!end || end[1])
            return ts_fail(st, TS_INVALID, "%s:%d: a section is written [name], not \"%.60s\"", ini->name, number, s);
        *end = 0;
        *section = trim(s + 1);
        if (!is_name(*section))
            return ts_fail(st, TS_INVALID, "%s:%d: \"%.60s\" is no section name", ini->name, number, *section);
        return TS_OK;
    }
    char *equals = strchr(s, '=');
    if (!equals) return ts_fail(st, TS_INVALID, "%s:%d: expected key = value, not \"%.60s\"", ini->name, number, s);
    *equals = 0;
    char *value = trim(equals + 1);
    const size_t length = strlen(value);
    if (*value == '"') {
        if (length < 2 || strchr(value + 1, '"') != value + length - 1)
            return ts_fail(st, TS_INVALID, "%s:%d: a value that begins with a quotation mark ends with the next one",
                           ini->name, number);
        value[length - 1] = 0;
        value++;
    }
    const io_ini_entry e = {.section = *section, .key = trim(s), .value = value, .line = number};
    if (!is_name(e.key)) return ts_fail(st, TS_INVALID, "%s:%d: \"%.60s\" is no key name", ini->name, number, e.key);
    if (!e.section)
        return ts_fail(st, TS_INVALID, "%s:%d: %s stands before the first [section]", ini->name, number, e.key);
    return add(ini, capacity, e, st);
}

static ts_code parse_text(io_ini *ini, size_t size, ts_status *st)
{
    char *p = ini->text;
    const char *section = NULL;
    int capacity = 0, number = 0;
    if (memchr(p, 0, size)) return ts_fail(st, TS_INVALID, "%s: not a text file (it contains a zero byte)", ini->name);
    if (size >= 3 && !memcmp(p, "\xef\xbb\xbf", 3)) p += 3; /* some editors begin UTF-8 files so */
    while (*p) {
        char *end = strchr(p, '\n'), *next = end ? end + 1 : p + strlen(p);
        if (end) *end = 0;
        const ts_code code = parse_line(ini, &capacity, p, ++number, &section, st);
        if (code != TS_OK) return code;
        p = next;
    }
    return TS_OK;
}

ts_code io_ini_parse(const char *name, const char *text, size_t size, io_ini *ini, ts_status *st)
{
    *ini = (io_ini){.name = strdup(name), .text = malloc(size + 1)};
    if (!ini->name || !ini->text) {
        io_ini_free(ini);
        return ts_fail(st, TS_NOMEM, "%s: out of memory", name);
    }
    memcpy(ini->text, text, size);
    ini->text[size] = 0;
    const ts_code code = parse_text(ini, size, st);
    if (code != TS_OK) io_ini_free(ini);
    return code;
}

ts_code io_ini_read(const char *path, io_ini *ini, ts_status *st)
{
    *ini = (io_ini){0};
    FILE *f = fopen(path, "rb");
    if (!f) return ts_fail(st, TS_IO, "%s: %s", path, strerror(errno));
    char *text = malloc(LARGEST + 1);
    const size_t size = text ? fread(text, 1, LARGEST + 1, f) : 0;
    const int error = ferror(f) ? errno : 0;
    fclose(f);
    ts_code code;
    if (!text) code = ts_fail(st, TS_NOMEM, "%s: out of memory", path);
    else if (error) code = ts_fail(st, TS_IO, "%s: %s", path, strerror(error));
    else if (size > LARGEST) code = ts_fail(st, TS_INVALID, "%s: larger than 1 MB, this is no configuration", path);
    else code = io_ini_parse(path, text, size, ini, st);
    free(text);
    return code;
}

bool io_ini_needs_quotes(const char *value)
{
    const size_t length = strlen(value);
    if (length > 0 && (*value == '"' || blank(*value) || blank(value[length - 1]))) return true;
    for (const char *p = value; *p; p++)
        if ((*p == '#' || *p == ';') && (p == value || blank(p[-1]))) return true;
    return false;
}

void io_ini_free(io_ini *ini)
{
    free(ini->name);
    free(ini->text);
    free(ini->entry);
    *ini = (io_ini){0};
}
