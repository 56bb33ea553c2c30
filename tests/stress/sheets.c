/* Photographs of a printed sheet as a phone takes them: how near the solved cameras, windows, exposures and flash are
 * to the true ones. */
#include "cli/data/sheet_captures.h"
#include "data/materials/procedural.h"
#include "data/rectify/sheet_set.h"
#include "tests/stress/stress.h"
#include <math.h>
#include <string.h>

enum { SIZE = 256, SEED = 5 };

/* The worst of all photographs. */
typedef struct errors {
    double camera; /* mm, where the window has 120 */
    double window; /* pixels of a window of 512: the root mean square over a grid of points */
    double exposure, focal;
    double flash; /* mm */
} errors;

/* How far the solved camera sees the window's points from where the true one does. */
static double misregistered(const io_pinhole *solved, const io_pinhole *truth)
{
    enum { POINTS = 9 };
    double sum = 0, pixel[2], beside[2], there[2];
    for (int i = 0; i < POINTS * POINTS; i++) {
        const double point[2] = {i % POINTS / (POINTS - 1.0) - 0.5, i / POINTS / (POINTS - 1.0) - 0.5};
        const double next[2] = {point[0] + 1 / 512.0, point[1]};
        io_pinhole_see(solved, point, pixel);
        io_pinhole_see(truth, point, there);
        io_pinhole_see(truth, next, beside);
        const double away = hypot(pixel[0] - there[0], pixel[1] - there[1]) /
            hypot(beside[0] - there[0], beside[1] - there[1]);
        sum += away * away;
    }
    return sqrt(sum / (POINTS * POINTS));
}

static void compare(const io_sheet_set *set, const cl_sheet_shot *shot, errors *e)
{
    for (int i = 0; i < CL_SHEET_SHOTS; i++) {
        const io_pinhole *c = &set->photo[i].sight.camera, *t = &shot[i].camera;
        const double away = hypot(hypot(c->at[0] - t->at[0], c->at[1] - t->at[1]), c->at[2] - t->at[2]);
        const double relative = set->photo[i].exposure[1] / set->photo[0].exposure[1],
                     want = shot[i].exposure / shot[0].exposure;
        e->camera = fmax(e->camera, away * IO_SHEET_WINDOW);
        e->window = fmax(e->window, misregistered(c, t));
        e->exposure = farther(e->exposure, fabs(relative / want - 1));
        e->focal = farther(e->focal, fabs(c->focal / t->focal - 1));
    }
    const double aside[2] = {set->aside[0] - shot[0].light[0], set->aside[1] - shot[0].light[1]};
    e->flash = fmax(e->flash, hypot(aside[0], aside[1]) * IO_SHEET_WINDOW);
}

/* Set number index of the sequence. */
static bool measure(const char *folder, int width, uint64_t index, errors *e, ts_status *st)
{
    char path[CL_SHEET_SHOTS][4096], *paths[CL_SHEET_SHOTS];
    cl_sheet_shot shot[CL_SHEET_SHOTS];
    io_sheet_set set;
    io_material m = {0};
    const io_procedural p = {.seed = SEED};
    for (int i = 0; i < CL_SHEET_SHOTS; i++) {
        snprintf(path[i], sizeof path[i], "%s/photo_%d.jpg", folder, i + 1);
        paths[i] = path[i];
    }
    ts_code code = io_material_create(&m, SIZE, st);
    if (!code) {
        io_procedural_make(&p, index, &m);
        code = cl_write_sheet_captures(folder, &m, SEED, index, width, 92, st);
    }
    io_material_free(&m);
    if (!code) code = io_sheet_set_read(paths, CL_SHEET_SHOTS, 0, IO_MAX_PIXELS_DEFAULT, 0, NULL, &set, st);
    if (code) return false;
    const bool all = set.good == CL_SHEET_SHOTS;
    for (int i = 0; i < CL_SHEET_SHOTS && !all; i++)
        if (set.photo[i].st.code) *st = set.photo[i].st;
    cl_sheet_shots(SEED, index, width, shot);
    if (all) compare(&set, shot, e);
    io_sheet_set_free(&set);
    return all;
}

bool stress_sheets(const stress *s)
{
    const int width = s->full ? 4000 : 1000, sets = s->full ? 3 : 1;
    errors e = {0};
    char what[96];
    bool ok = true;
    for (int i = 0; i < sets && ok; i++) {
        ts_status st = {0};
        ok = measure(s->folder, width, (uint64_t)i, &e, &st);
        if (st.code == TS_UNSUPPORTED) {
            printf("sheets: not run: %s\n", st.message);
            return true;
        }
        if (!ok) printf("set %d: %s\n", i, st.message);
    }
    snprintf(what, sizeof what, "sheets: camera, mm (%d sets of %d photographs, %d pixels wide)", sets, CL_SHEET_SHOTS,
             width);
    ok = stress_row(what, e.camera, 0.4) && ok;
    ok = stress_row("sheets: window, pixels of 512", e.window, 0.2) && ok;
    ok = stress_row("sheets: exposure, relative to the first photograph's", e.exposure, 0.0015) && ok;
    ok = stress_row("sheets: flash beside the lens, mm", e.flash, 0.25) && ok;
    return stress_row("sheets: focal length, relative", e.focal, 0.0005) && ok;
}
