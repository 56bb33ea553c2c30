#include "eval/set_ini.h"
#include "data/file.h"
#include <limits.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

static const struct {
    const char *key, *value[2]; /* the values that 1 and 2 stand for in io_map_convention's enums */
} keys[] = {{"workflow", {"metallic", "specular"}}, {"normal", {"opengl", "directx"}}, {"colour", {"srgb", "linear"}}};

bool ev_set_ini_key(const char *key, const char *value, io_map_convention *c)
{
    for (size_t k = 0; k < sizeof keys / sizeof *keys; k++)
        for (int v = 0; v < 2; v++) {
            if (strcmp(key, keys[k].key) != 0 || strcmp(value, keys[k].value[v]) != 0) continue;
            if (k == 0) c->workflow = (io_workflow)(v + 1);
            else if (k == 1) c->normal = (io_normal)(v + 1);
            else c->colour = (io_encoding)(v + 1);
            return true;
        }
    return false;
}

static char *trim(char *text)
{
    text += strspn(text, " \t\r");
    size_t n = strlen(text);
    while (n && strchr(" \t\r", text[n - 1])) text[--n] = 0;
    return text;
}

static ts_code parse(const char *path, char *text, io_map_convention *c, ts_status *st)
{
    if (!strncmp(text, "\xef\xbb\xbf", 3)) text += 3; /* a byte-order mark */
    char *rest = text;
    for (int line = 1; rest; line++) {
        char *now = strsep(&rest, "\n");
        now[strcspn(now, "#;")] = 0;
        now = trim(now);
        if (!*now) continue;
        char *equals = strchr(now, '=');
        if (equals) *equals = 0;
        if (!equals || !ev_set_ini_key(trim(now), trim(equals + 1), c))
            return ts_fail(
                st, TS_FORMAT,
                "%s:%d: should be workflow = metallic | specular, normal = opengl | directx or colour = srgb | linear",
                path, line);
    }
    return TS_OK;
}

ts_code ev_set_ini(const char *folder, const io_map_convention *given, io_map_convention *out, ts_status *st)
{
    char path[PATH_MAX], *text;
    size_t size;
    *out = (io_map_convention){0};
    if (snprintf(path, sizeof path, "%s/set.ini", folder) >= (int)sizeof path)
        return ts_fail(st, TS_INVALID, "%s: the name is too long", folder);
    if (access(path, F_OK) == 0) {
        ts_code code = io_read_bytes(path, 1 << 16, &text, &size, st);
        if (code) return code;
        code = parse(path, text, out, st);
        free(text);
        if (code) return code;
    }
    if (given && given->normal) out->normal = given->normal;
    if (given && given->workflow) out->workflow = given->workflow;
    if (given && given->colour) out->colour = given->colour;
    return TS_OK;
}
