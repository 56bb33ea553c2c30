#include "data/capture_ini.h"
#include "data/ini.h"
#include "data/name.h"
#include "data/rectify/corners.h"
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
    bool light, camera, angled;
    io_corners corners;    /* where angled */
    float exposure, focal; /* 0: not given */
} photo;

/* A number above 0. */
static ts_code read_positive(const char *path, const io_ini_entry *e, float *to, ts_status *st)
{
    if (read_numbers(path, e, 1, to, st) != TS_OK) return st->code;
    return *to > 0 ? TS_OK
                   : ts_fail(st, TS_INVALID, "%s:%d: %s.%s is %s: it must be above 0", path, e->line, e->section,
                             e->key, e->value);
}

static ts_code take_head(const char *path, const io_ini_entry *e, float *side, float *power, ts_status *st)
{
    float *to = !strcmp(e->key, "side") ? side : !strcmp(e->key, "power") ? power : NULL;
    if (!to)
        return ts_fail(st, TS_INVALID, "%s:%d: [capture] has the keys side and power, not %s", path, e->line, e->key);
    return read_positive(path, e, to, st);
}

static ts_code take_photo(const char *path, const io_ini_entry *e, photo *p, float light[3], float camera[3],
                          ts_status *st)
{
    if (!strcmp(e->key, "file")) {
        p->file = e->value;
        return *e->value ? TS_OK : ts_fail(st, TS_INVALID, "%s:%d: %s.file is empty", path, e->line, e->section);
    }
    if (!strcmp(e->key, "exposure")) return read_positive(path, e, &p->exposure, st);
    if (!strcmp(e->key, "focal")) return read_positive(path, e, &p->focal, st);
    if (!strcmp(e->key, "corners")) {
        p->angled = true;
        if (io_corners_parse(&e->value, 1, &p->corners, st) == TS_OK) return TS_OK;
        return ts_context(st, "%s:%d: %s.corners", path, e->line, e->section);
    }
    const bool is_light = !strcmp(e->key, "light");
    if (!is_light && strcmp(e->key, "camera") != 0)
        return ts_fail(st, TS_INVALID,
                       "%s:%d: a photograph has the keys file, light, camera, exposure, corners and focal, not %s",
                       path, e->line, e->key);
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
            : photos[k].angled                ? NULL
            : photos[k].focal > 0             ? "corners, which focal is for"
            : !photos[k].light                ? "light"
            : !photos[k].camera               ? "camera"
                                              : NULL;
        if (missing)
            return ts_fail(st, TS_INVALID, "%s:%d: [%s] has no %s", path, photos[k].line, photos[k].section, missing);
    }
    return TS_OK;
}

static void note_profile(io_capture *c, const char *file, const char *profile)
{
    if (*c->profile || !*profile) return;
    snprintf(c->profile, sizeof c->profile, "%s", profile);
    snprintf(c->profile_of, sizeof c->profile_of, "%s", file);
}

/* The square that has the corners, and the camera that sees it so, where the file does not say another. */
static ts_code read_angled(const char *name, const photo *p, int64_t max_pixels, int k, io_capture *c, io_image *square,
                           double *side, ts_status *st)
{
    char why[128];
    io_photo_rows rows;
    io_pinhole camera;
    *square = (io_image){0};
    if (io_photo_open(name, max_pixels, true, &rows, st) != TS_OK) return st->code;
    io_lens lens = rows.raw.lens;
    if (p->focal > 0) lens = (io_lens){.focal_35mm = (double)p->focal};
    const double fov = io_lens_fov(&lens, rows.width, rows.height, why, sizeof why);
    ts_code code = fov > 0
        ? TS_OK
        : ts_fail(st, TS_INVALID, "%s; [%s] needs a focal length: focal = 26, in mm on 35 mm film", why, p->section);
    if (!code) code = io_corners_rectify(&rows, &p->corners, fov, c->size, 0, square, &camera, side, st);
    note_profile(c, p->file, rows.unread);
    io_photo_close(&rows);
    if (code) return ts_context(st, "%s", name);
    for (int i = 0; i < 3; i++) {
        if (!p->camera) c->camera[k][i] = (float)camera.at[i];
        if (!p->light) c->light[k][i] = c->camera[k][i];
    }
    return TS_OK;
}

/* Beside the INI file, or absolute. The caller frees it. */
static char *path_beside(const char *ini, const char *file, ts_status *st)
{
    char *path = NULL;
    const char *slash = strrchr(ini, '/');
    const int folder = slash && file[0] != '/' ? (int)(slash + 1 - ini) : 0;
    if (asprintf(&path, "%.*s%s", folder, ini, file) >= 0) return path;
    ts_fail(st, TS_NOMEM, "%s: out of memory", ini);
    return NULL;
}

ts_code io_capture_ini_files(const char *path, char *file[IO_CAPTURE_IMAGES], int *files, ts_status *st)
{
    io_ini ini;
    *files = 0;
    if (io_ini_read(path, &ini, st) != TS_OK) return st->code;
    for (int i = 0; i < ini.count && *files < IO_CAPTURE_IMAGES && !st->code; i++)
        if (!strcmp(ini.entry[i].key, "file") && (file[*files] = path_beside(path, ini.entry[i].value, st))) ++*files;
    io_ini_free(&ini);
    return st->code;
}

/* The photograph's square as picture number k of c. */
static ts_code read_square(const char *path, const photo *p, int64_t max_pixels, int k, io_capture *c, ts_status *st)
{
    io_image square = {0};
    io_photo_facts facts = {0};
    double side = 0;
    char *name = path_beside(path, p->file, st);
    if (!name) return st->code;
    ts_code code = p->angled ? read_angled(name, p, max_pixels, k, c, &square, &side, st)
                             : io_read_photo_square(name, max_pixels, c->size, 0, &square, &facts, st);
    note_profile(c, p->file, facts.profile);
    if (!p->angled) side = facts.width < facts.height ? facts.width : facts.height;
    if (!code) code = io_capture_note(c, k, name, (int)ceil(side), square.data, st);
    free(name);
    const size_t values = (size_t)c->size * (size_t)c->size * 3;
    const float gain = p->exposure > 0 ? 1 / p->exposure : 1;
    for (size_t i = 0; i < values && !code; i++) c->image[(size_t)k * values + i] = square.data[i] * gain;
    io_image_free(&square);
    return code;
}

ts_code io_read_capture_ini(const char *path, int size, float default_power, int64_t max_pixels, io_capture *c,
                            ts_status *st)
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
    for (int i = 0; i < 3 && !code; i++) c->power[i] = power > 0 ? power / (places.side * places.side) : default_power;
    if (code) io_capture_free(c);
    else io_name_from_path(path, c->name, sizeof c->name);
    io_ini_free(&ini);
    return code;
}
