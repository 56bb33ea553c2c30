#include "data/rectify/sheet_set.h"
#include <math.h>
#include <stdlib.h>
#include <string.h>

#define BURNT 0.99f

static const double window_corner[4][2] = {{-0.5, 0.5}, {0.5, 0.5}, {0.5, -0.5}, {-0.5, -0.5}};

/* The tags, and the focal length in pixels, 0 where it is not known. */
static void find(io_sheet_photo *p, double fov, int64_t max_pixels, int threads)
{
    char why[128];
    io_photo_rows photo;
    if (io_photo_open(p->path, max_pixels, true, &photo, &p->st) != TS_OK) return;
    memcpy(p->profile, photo.unread, sizeof p->profile);
    if (!(fov > 0)) fov = io_lens_fov(&photo.raw.lens, photo.width, photo.height, why, sizeof why);
    p->sight.camera = (io_pinhole){.width = photo.width, .height = photo.height};
    if (fov > 0) p->sight.camera.focal = io_focal_of(fov, photo.width, photo.height);
    if (io_tags_find(&photo, threads, &p->sight.tags, &p->st) != TS_OK) ts_context(&p->st, "%s", p->path);
    io_photo_close(&photo);
}

/* A focal length for those that have none: the mean of the others in diagonals, or a phone's. */
static void guess_focal(io_sheet_set *set)
{
    double sum = 0;
    int known = 0;
    for (int i = 0; i < set->photos; i++) {
        const io_pinhole *c = &set->photo[i].sight.camera;
        if (set->photo[i].st.code || !(c->focal > 0)) continue;
        sum += c->focal / hypot(c->width, c->height);
        known++;
    }
    set->sure = known > 0;
    for (int i = 0; i < set->photos; i++) {
        io_pinhole *c = &set->photo[i].sight.camera;
        if (!(c->focal > 0)) c->focal = (known ? sum / known : IO_PHONE_FOCAL) * hypot(c->width, c->height);
    }
}

/* A photograph whose pose cannot be is left out: some other sheet has such tags too. */
static ts_code solve(io_sheet_set *set, ts_status *st)
{
    io_sight *sight = calloc((size_t)set->photos, sizeof *sight);
    int n, bad = -1, of[IO_SOLVE_MOST];
    ts_code code;
    if (!sight) return ts_fail(st, TS_NOMEM, "out of memory for %d photographs", set->photos);
    do {
        *st = (ts_status){0};
        n = 0;
        for (int i = 0; i < set->photos; i++)
            if (!set->photo[i].st.code) of[n] = i, sight[n++] = set->photo[i].sight;
        code = n ? io_solve(sight, n, set->sure, &bad, st) : TS_OK;
        if (code == TS_NOMEM) bad = -1;
        if (code && bad >= 0) {
            io_sheet_photo *p = &set->photo[of[bad]];
            ts_fail(&p->st, code, "%s: its tags do not lie as those of the sheet do: %s", p->path, st->message);
        }
    } while (code && bad >= 0);
    for (int i = 0; i < n && !code; i++) set->photo[of[i]].sight = sight[i];
    free(sight);
    return code;
}

static int up(const void *a, const void *b)
{
    const double x = *(const double *)a, y = *(const double *)b;
    return (x > y) - (x < y);
}

/* How wide an edge of a tag is from 10% to 90%, in the window's sides; across: the direction out of the tag. */
static double edge_width(const io_photo_rows *photo, const io_pinhole *c, const double at[2], const double across[2])
{
    enum { STEPS = 41 };
    const double reach = 0.8 * IO_TAG_CELL;
    double value[STEPS], ten = 0, ninety = 0;
    for (int i = 0; i < STEPS; i++) {
        const double away = reach * (2.0 * i / (STEPS - 1) - 1);
        const double point[2] = {at[0] + away * across[0], at[1] + away * across[1]};
        double pixel[2];
        float rgb[3];
        io_pinhole_see(c, point, pixel);
        io_photo_at(photo, pixel, rgb);
        value[i] = (double)rgb[1];
    }
    const double low = (value[0] + value[1] + value[2]) / 3,
                 high = (value[STEPS - 1] + value[STEPS - 2] + value[STEPS - 3]) / 3;
    for (int i = 1; i < STEPS; i++) {
        const double before = (value[i - 1] - low) / (high - low), now = (value[i] - low) / (high - low);
        if (before < 0.1 && now >= 0.1) ten = i - (now - 0.1) / (now - before);
        if (before < 0.9 && now >= 0.9 && ninety == 0) ninety = i - (now - 0.9) / (now - before);
    }
    return high > low ? fmax(ninety - ten, 0) * 2 * reach / (STEPS - 1) : 0;
}

static double edges(const io_photo_rows *photo, const io_sight *s)
{
    double width[4 * IO_SHEET_TAGS];
    for (int t = 0; t < s->tags.count; t++) {
        double corner[4][2], centre[2];
        io_tag_corners(s->tags.id[t], corner);
        io_tag_centre(s->tags.id[t], centre);
        for (int k = 0; k < 4; k++) {
            const double middle[2] = {(corner[k][0] + corner[(k + 1) % 4][0]) / 2,
                                      (corner[k][1] + corner[(k + 1) % 4][1]) / 2};
            const double out[2] = {middle[0] - centre[0], middle[1] - centre[1]}, length = hypot(out[0], out[1]);
            width[4 * t + k] = edge_width(photo, &s->camera, middle,
                                          (const double[2]){out[0] / length, out[1] / length});
        }
    }
    qsort(width, 4 * (size_t)s->tags.count, sizeof *width, up);
    return width[2 * s->tags.count] * 512;
}

static double burnt(const io_photo_rows *photo, const io_pinhole *c)
{
    enum { SIDE = 64 };
    int over = 0;
    for (int i = 0; i < SIDE * SIDE; i++) {
        const double point[2] = {(i % SIDE + 0.5) / SIDE - 0.5, 0.5 - (i / SIDE + 0.5) / SIDE};
        double pixel[2];
        float rgb[3];
        io_pinhole_see(c, point, pixel);
        io_photo_at(photo, pixel, rgb);
        for (int k = 0; k < 3; k++) over += rgb[k] >= BURNT;
    }
    return over / (3.0 * SIDE * SIDE);
}

/* What the pose has to be known for. */
static void look(io_sheet_photo *p, int64_t max_pixels)
{
    io_photo_rows photo;
    for (int k = 0; k < 4; k++) {
        double pixel[2];
        const io_pinhole *c = &p->sight.camera;
        if (io_pinhole_see(c, window_corner[k], pixel) && pixel[0] >= 0 && pixel[1] >= 0 && pixel[0] <= c->width &&
            pixel[1] <= c->height)
            continue;
        ts_fail(&p->st, TS_INVALID, "%s: the sheet's window is not whole in the picture: photograph all of the frame",
                p->path);
        return;
    }
    if (io_photo_open(p->path, max_pixels, true, &photo, &p->st) != TS_OK) return;
    io_whites_read(&photo, &p->sight.camera, &p->whites);
    p->edge = edges(&photo, &p->sight);
    p->burnt = burnt(&photo, &p->sight.camera);
    io_photo_close(&photo);
    if (p->whites.count >= IO_WHITES_LEAST) return;
    ts_fail(&p->st, TS_INVALID, "%s: the sheet's paper is %s: photograph it %s", p->path,
            p->whites.burnt >= IO_WHITES_LEAST ? "burnt out" : "too dark to measure its light",
            p->whites.burnt >= IO_WHITES_LEAST ? "with less exposure" : "with the flash, from nearer by");
}

static ts_code light(io_sheet_set *set, ts_status *st)
{
    const size_t n = (size_t)set->photos;
    io_pinhole *camera = calloc(n, sizeof *camera);
    io_whites *whites = calloc(n, sizeof *whites);
    double(*exposure)[3] = calloc(n, sizeof *exposure);
    ts_code code = camera && whites && exposure ? TS_OK : ts_fail(st, TS_NOMEM, "out of memory");
    int k = 0;
    for (size_t i = 0; i < n && !code; i++)
        if (!set->photo[i].st.code) {
            camera[k] = set->photo[i].sight.camera;
            whites[k++] = set->photo[i].whites;
        }
    if (!code) code = io_paper_fit(k, camera, whites, exposure, set->aside, st);
    k = 0;
    for (size_t i = 0; i < n && !code; i++)
        if (!set->photo[i].st.code) memcpy(set->photo[i].exposure, exposure[k++], sizeof *exposure);
    free(camera);
    free(whites);
    free(exposure);
    return code;
}

static int count_good(io_sheet_set *set)
{
    set->good = 0;
    for (int i = 0; i < set->photos; i++) set->good += !set->photo[i].st.code;
    return set->good;
}

static ts_code go_on(bool (*stop)(void), ts_status *st)
{
    return stop && stop() ? ts_fail(st, TS_INTERRUPTED, "interrupted while the sheet was read") : TS_OK;
}

ts_code io_sheet_set_read(char *const *paths, int count, double fov, int64_t max_pixels, int threads,
                          bool (*stop)(void), io_sheet_set *set, ts_status *st)
{
    *set = (io_sheet_set){.photo = calloc((size_t)count, sizeof *set->photo), .photos = count};
    if (!set->photo) return ts_fail(st, TS_NOMEM, "out of memory for %d photographs", count);
    ts_code code = TS_OK;
    for (int i = 0; i < count && !code; i++) {
        set->photo[i].path = paths[i];
        if (!(code = go_on(stop, st))) find(&set->photo[i], fov, max_pixels, threads);
    }
    if (!code) guess_focal(set);
    if (!code && count_good(set) > 0) code = solve(set, st);
    for (int i = 0; i < count && !code; i++)
        if (!set->photo[i].st.code && !(code = go_on(stop, st))) look(&set->photo[i], max_pixels);
    if (!code && count_good(set) > 0) code = light(set, st);
    if (code) io_sheet_set_free(set);
    return code;
}

void io_sheet_set_free(io_sheet_set *set)
{
    free(set->photo);
    *set = (io_sheet_set){0};
}

static void pixel_of(const double point[2], double pixel[2], const void *user)
{
    io_pinhole_see(user, (const double[2]){point[0] - 0.5, 0.5 - point[1]}, pixel);
}

ts_code io_sheet_window(const io_sheet_photo *photo, int size, int64_t max_pixels, int threads, io_image *window,
                        ts_status *st)
{
    io_photo_rows rows;
    *window = (io_image){0};
    if (io_photo_open(photo->path, max_pixels, true, &rows, st) != TS_OK) return st->code;
    const ts_code code = io_warp(&rows, &(io_view_of){pixel_of, &photo->sight.camera}, size, threads, window, st);
    if (code) ts_context(st, "%s", photo->path);
    io_photo_close(&rows);
    return code;
}

double io_sheet_window_side(const io_sheet_photo *photo)
{
    double at[4][2], side = 0;
    for (int k = 0; k < 4; k++) io_pinhole_see(&photo->sight.camera, window_corner[k], at[k]);
    for (int k = 0; k < 4; k++) side += hypot(at[k][0] - at[(k + 1) % 4][0], at[k][1] - at[(k + 1) % 4][1]) / 4;
    return side;
}
