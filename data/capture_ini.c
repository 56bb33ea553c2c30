#include "data/capture_ini.h"
#include "data/ini.h"
#include "data/name.h"
#include <limits.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* count finite numbers between commas. */
static ts_code read_numbers(const char *path, const io_ini_entry *e, int count, float *to, ts_status *st)
{
    const char *p = e->value;
    bool fine = true;
    for (int i = 0; i < count && fine; i++) {
        char *end;
        to[i] = strtof(p, &end);
        fine = end != p && isfinite(to[i]);
        p = end + strspn(end, " \t");
        if (i + 1 < count) fine = fine && *p++ == ',';
    }
    if (fine && !*p) return TS_OK;
    return ts_fail(st, TS_INVALID, "%s:%d: %s.%s is \"%.60s\": it must be %s", path, e->line, e->section, e->key,
                   e->value, count == 1 ? "a number" : "three numbers x, y, z");
}

typedef struct photo {
    const char *section, *file;
    int line;
    bool light, camera;
} photo;

static ts_code take_head(const char *path, const io_ini_entry *e, float *side, float *power, ts_status *st)
{
    float *to = !strcmp(e->key, "side") ? side : !strcmp(e->key, "power") ? power : NULL;
    if (!to)
        return ts_fail(st, TS_INVALID, "%s:%d: [capture] has the keys side and power, not %s", path, e->line, e->key);
    if (read_numbers(path, e, 1, to, st) != TS_OK) return st->code;
    return *to > 0
        ? TS_OK
        : ts_fail(st, TS_INVALID, "%s:%d: capture.%s is %s: it must be above 0", path, e->line, e->key, e->value);
}

static ts_code take_photo(const char *path, const io_ini_entry *e, photo *p, float light[3], float camera[3],
                          ts_status *st)
{
    if (!strcmp(e->key, "file")) {
        p->file = e->value;
        return *e->value ? TS_OK : ts_fail(st, TS_INVALID, "%s:%d: %s.file is empty", path, e->line, e->section);
    }
    const bool is_light = !strcmp(e->key, "light");
    if (!is_light && strcmp(e->key, "camera") != 0)
        return ts_fail(st, TS_INVALID, "%s:%d: a photograph has the keys file, light and camera, not %s", path, e->line,
                       e->key);
    float *to = is_light ? light : camera;
    *(is_light ? &p->light : &p->camera) = true;
    if (read_numbers(path, e, 3, to, st) != TS_OK) return st->code;
    return to[2] > 0 ? TS_OK
                     : ts_fail(st, TS_INVALID, "%s:%d: %s.%s has z = %g: it must be above the sample", path, e->line,
                               e->section, e->key, (double)to[2]);
}

static ts_code take(const char *path, const io_ini *ini, photo *photos, io_capture *c, float *power, ts_status *st)
{
    for (int i = 0; i < ini->count; i++) {
        const io_ini_entry *e = &ini->entry[i];
        int k = 0;
        if (!strcmp(e->section, "capture")) {
            if (take_head(path, e, &c->side, power, st) != TS_OK) return st->code;
            continue;
        }
        while (k < c->images && strcmp(photos[k].section, e->section) != 0) k++;
        if (k == IO_CAPTURE_IMAGES)
            return ts_fail(st, TS_INVALID, "%s:%d: more than %d photographs", path, e->line, IO_CAPTURE_IMAGES);
        if (k == c->images) photos[c->images++] = (photo){.section = e->section, .line = e->line};
        if (take_photo(path, e, &photos[k], c->light[k], c->camera[k], st) != TS_OK) return st->code;
    }
    if (c->images == 0)
        return ts_fail(st, TS_INVALID, "%s: lists no photograph: a section with file, light and camera for each", path);
    for (int k = 0; k < c->images; k++) {
        const char *missing = !photos[k].file ? "file"
            : !photos[k].light                ? "light"
            : !photos[k].camera               ? "camera"
                                              : NULL;
        if (missing)
            return ts_fail(st, TS_INVALID, "%s:%d: [%s] has no %s", path, photos[k].line, photos[k].section, missing);
    }
    return TS_OK;
}

/* The photograph's square as picture number k of c. */
static ts_code read_square(const char *path, const photo *p, int64_t max_pixels, int k, io_capture *c, ts_status *st)
{
    char name[PATH_MAX];
    const char *slash = strrchr(path, '/');
    const int folder = slash && p->file[0] != '/' ? (int)(slash + 1 - path) : 0;
    if (snprintf(name, sizeof name, "%.*s%s", folder, path, p->file) >= PATH_MAX)
        return ts_fail(st, TS_INVALID, "%s:%d: the file's name is too long", path, p->line);
    io_image square;
    const ts_code code = io_read_photo_square(name, max_pixels, c->size, 0, &square, NULL, st);
    const size_t values = (size_t)c->size * (size_t)c->size * 3;
    if (!code) memcpy(c->image + (size_t)k * values, square.data, values * sizeof(float));
    io_image_free(&square);
    return code;
}

ts_code io_read_capture_ini(const char *path, int size, float usual, int64_t max_pixels, io_capture *c, ts_status *st)
{
    io_ini ini;
    *c = (io_capture){0};
    if (io_ini_read(path, &ini, st) != TS_OK) return st->code;
    photo photos[IO_CAPTURE_IMAGES];
    io_capture places = {.side = 1};
    float power = 0;
    ts_code code = take(path, &ini, photos, &places, &power, st);
    if (!code) code = io_capture_create(c, places.images, size, st);
    for (int k = 0; k < places.images && !code; k++) {
        for (int i = 0; i < 3; i++) {
            c->light[k][i] = places.light[k][i] / places.side;
            c->camera[k][i] = places.camera[k][i] / places.side;
        }
        code = read_square(path, &photos[k], max_pixels, k, c, st);
    }
    c->side = places.side;
    for (int i = 0; i < 3 && !code; i++) c->power[i] = power > 0 ? power / (places.side * places.side) : usual;
    if (code) io_capture_free(c);
    else io_name_from_path(path, c->name, sizeof c->name);
    io_ini_free(&ini);
    return code;
}
