#include "data/rectify/solve.h"
#include "data/rectify/least_squares.h"
#include <math.h>
#include <stdlib.h>
#include <string.h>

#define CORNER 0.25 /* pixels */
#define SURE 0.02
#define GUESS 0.3
#define RADIAL 0.1

enum { SHARED = 2, POSE = 6 }; /* unknowns: logarithm of the factor, distortion; then a rotation and a place each */

typedef struct fit {
    const io_sight *sight;
    int count;
    double prior;
} fit;

static io_pinhole camera_of(const io_sight *s, const double *shared, const double *pose)
{
    io_pinhole c = s->camera;
    c.focal *= exp(shared[0]);
    c.radial = shared[1];
    io_rotate(pose, s->camera.rotation, c.rotation);
    memcpy(c.at, pose + 3, sizeof c.at);
    return c;
}

static void residuals(const double *x, double *residual, void *user)
{
    const fit *f = user;
    *residual++ = x[0] / f->prior;
    *residual++ = x[1] / RADIAL;
    for (int i = 0; i < f->count; i++) {
        const io_sight *s = &f->sight[i];
        const io_pinhole c = camera_of(s, x, x + SHARED + POSE * i);
        for (int t = 0; t < s->tags.count; t++) {
            double point[4][2];
            io_tag_corners(s->tags.id[t], point);
            for (int k = 0; k < 4; k++, residual += 2) {
                double pixel[2];
                io_pinhole_see(&c, point[k], pixel);
                for (int a = 0; a < 2; a++) residual[a] = (pixel[a] - s->tags.corner[t][k][a]) / CORNER;
            }
        }
    }
}

static double tag_rms(const io_sight *s, int t)
{
    double point[4][2], pixel[2], sum = 0;
    io_tag_corners(s->tags.id[t], point);
    for (int k = 0; k < 4; k++) {
        io_pinhole_see(&s->camera, point[k], pixel);
        for (int a = 0; a < 2; a++) sum += pow(pixel[a] - s->tags.corner[t][k][a], 2);
    }
    return sqrt(sum / 4);
}

static int up(const void *a, const void *b)
{
    const double x = *(const double *)a, y = *(const double *)b;
    return (x > y) - (x < y);
}

/* Tags that are several times as far off as the others: hidden in part, or something else. True: there were some. */
static bool clean(io_sight *s)
{
    enum { TIMES = 5 };
    double rms[IO_SHEET_TAGS], sorted[IO_SHEET_TAGS];
    io_tags kept = {0};
    for (int t = 0; t < s->tags.count; t++) sorted[t] = rms[t] = tag_rms(s, t);
    qsort(sorted, (size_t)s->tags.count, sizeof *sorted, up);
    const double most = TIMES * sorted[s->tags.count / 2] + 2 * CORNER;
    for (int t = 0; t < s->tags.count; t++) {
        if (rms[t] > most) continue;
        kept.id[kept.count] = s->tags.id[t];
        memcpy(kept.corner[kept.count++], s->tags.corner[t], sizeof *kept.corner);
    }
    const bool fewer = kept.count < s->tags.count && kept.count >= IO_TAGS_LEAST;
    if (fewer) s->tags = kept;
    return fewer;
}

/* From the focal lengths as they are known, and from the factor and the distortion of an earlier fit. */
static ts_code refine(io_sight *sight, int count, bool sure, double shared[SHARED], int *bad, ts_status *st)
{
    double x[SHARED + POSE * IO_SOLVE_MOST] = {shared[0], shared[1]}, step[SHARED + POSE * IO_SOLVE_MOST];
    fit f = {sight, count, sure ? SURE : GUESS};
    io_problem p = {SHARED + POSE * count, SHARED, step, residuals, &f};
    for (int j = 0; j < p.n; j++) step[j] = 1e-5;
    for (int i = 0; i < count; i++) {
        p.count += 8 * sight[i].tags.count;
        memcpy(x + SHARED + POSE * i + 3, sight[i].camera.at, sizeof sight[i].camera.at);
    }
    if (io_least_squares(&p, x, NULL, st) != TS_OK) return st->code;
    memcpy(shared, x, SHARED * sizeof *x);
    for (int i = 0; i < count; i++) {
        io_sight *s = &sight[i];
        s->camera = camera_of(s, x, x + SHARED + POSE * i);
        s->rms = 0;
        for (int t = 0; t < s->tags.count; t++) s->rms += pow(tag_rms(s, t), 2) / s->tags.count;
        s->rms = sqrt(s->rms);
        if (s->camera.at[2] > 0) continue;
        *bad = i;
        return ts_fail(st, TS_INVALID, "the tags put the camera below the sheet");
    }
    return TS_OK;
}

ts_code io_solve(io_sight *sight, int count, bool sure, int *bad, ts_status *st)
{
    double known[IO_SOLVE_MOST], shared[SHARED] = {0};
    bool again = false;
    *bad = -1;
    for (int i = 0; i < count; i++) {
        io_sight *s = &sight[i];
        double point[IO_SHEET_TAGS][4][2];
        for (int t = 0; t < s->tags.count; t++) io_tag_corners(s->tags.id[t], point[t]);
        known[i] = s->camera.focal;
        s->camera.radial = 0;
        if (io_pinhole_pose(4 * s->tags.count, (const double(*)[2])point, (const double(*)[2])s->tags.corner,
                            &s->camera, NULL, st) != TS_OK) {
            *bad = i;
            return st->code;
        }
    }
    if (refine(sight, count, sure, shared, bad, st) != TS_OK) return st->code;
    for (int i = 0; i < count; i++) again = clean(&sight[i]) || again;
    if (!again) return TS_OK;
    for (int i = 0; i < count; i++) sight[i].camera.focal = known[i];
    return refine(sight, count, sure, shared, bad, st);
}
