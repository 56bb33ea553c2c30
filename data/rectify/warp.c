#include "data/rectify/warp.h"
#include "tensor/team.h"
#include <math.h>
#include <stdlib.h>

/* A part of the photograph as floats. */
typedef struct part {
    int x, y, width, height;
    float *data; /* [height][width][3] */
} part;

static int clamp(int v, int lo, int hi) { return v < lo ? lo : v > hi ? hi : v; }

/* Linear interpolation between four pixels' centres. */
static void add(const part *p, const double pixel[2], float sum[3])
{
    const double x = pixel[0] - 0.5 - p->x, y = pixel[1] - 0.5 - p->y;
    const int i = (int)floor(x), j = (int)floor(y);
    const float fx = (float)(x - i), fy = (float)(y - j);
    const int left = clamp(i, 0, p->width - 1), right = clamp(i + 1, 0, p->width - 1);
    const float *above = p->data + (size_t)clamp(j, 0, p->height - 1) * (size_t)p->width * 3,
                *below = p->data + (size_t)clamp(j + 1, 0, p->height - 1) * (size_t)p->width * 3;
    for (int c = 0; c < 3; c++) {
        const float top = above[3 * left + c] + fx * (above[3 * right + c] - above[3 * left + c]);
        const float bottom = below[3 * left + c] + fx * (below[3 * right + c] - below[3 * left + c]);
        sum[c] += top + fy * (bottom - top);
    }
}

void io_photo_at(const io_photo_rows *photo, const double pixel[2], float rgb[3])
{
    float four[12];
    part p = {.x = clamp((int)floor(pixel[0] - 0.5), 0, photo->width - 1),
              .y = clamp((int)floor(pixel[1] - 0.5), 0, photo->height - 1),
              .data = four};
    p.width = p.x + 1 < photo->width ? 2 : 1;
    p.height = p.y + 1 < photo->height ? 2 : 1;
    for (int r = 0; r < p.height; r++) io_photo_row(photo, p.x, p.y + r, p.width, four + (size_t)(3 * r * p.width));
    rgb[0] = rgb[1] = rgb[2] = 0;
    add(&p, pixel, rgb);
}

/* What the border of the square encloses: the inside of a square is seen inside of its border. */
static bool bounds(const io_photo_rows *photo, const io_view_of *view, part *p)
{
    enum { STEPS = 64 };
    double lo[2] = {INFINITY, INFINITY}, hi[2] = {-INFINITY, -INFINITY};
    for (int side = 0; side < 4; side++)
        for (int i = 0; i <= STEPS; i++) {
            const double along = (double)i / STEPS, end = side & 1;
            const double point[2] = {side < 2 ? along : end, side < 2 ? end : along};
            double pixel[2];
            view->pixel(point, pixel, view->user);
            for (int k = 0; k < 2; k++) {
                if (!(fabs(pixel[k]) < 1e9)) return false;
                lo[k] = fmin(lo[k], pixel[k]);
                hi[k] = fmax(hi[k], pixel[k]);
            }
        }
    p->x = clamp((int)floor(lo[0]) - 3, 0, photo->width - 1);
    p->y = clamp((int)floor(lo[1]) - 3, 0, photo->height - 1);
    p->width = clamp((int)ceil(hi[0]) + 3, p->x + 1, photo->width) - p->x;
    p->height = clamp((int)ceil(hi[1]) + 3, p->y + 1, photo->height) - p->y;
    return true;
}

static int taps(const double a[2], const double b[2])
{
    enum { MOST = 64 };
    return clamp((int)ceil(hypot(b[0] - a[0], b[1] - a[1])), 1, MOST);
}

static void resample(const part *p, const io_view_of *view, int size, int row, float *to)
{
    for (int i = 0; i < size; i++, to += 3) {
        double left[2], right[2], top[2], bottom[2], pixel[2];
        const double x = i + 0.5, y = row + 0.5;
        view->pixel((double[2]){(x - 0.5) / size, y / size}, left, view->user);
        view->pixel((double[2]){(x + 0.5) / size, y / size}, right, view->user);
        view->pixel((double[2]){x / size, (y - 0.5) / size}, top, view->user);
        view->pixel((double[2]){x / size, (y + 0.5) / size}, bottom, view->user);
        const int across = taps(left, right), down = taps(top, bottom);
        float sum[3] = {0};
        for (int v = 0; v < down; v++)
            for (int u = 0; u < across; u++) {
                const double point[2] = {(i + (u + 0.5) / across) / size, (row + (v + 0.5) / down) / size};
                view->pixel(point, pixel, view->user);
                add(p, pixel, sum);
            }
        for (int c = 0; c < 3; c++) to[c] = sum[c] / (float)(across * down);
    }
}

typedef struct warp_job {
    const io_photo_rows *photo;
    const part *p;
    const io_view_of *view;
    int size;
    float *to;
} warp_job;

static void read_rows(const void *job, int64_t begin, int64_t end)
{
    const warp_job *j = job;
    const part *p = j->p;
    for (int64_t y = begin; y < end; y++)
        io_photo_row(j->photo, p->x, p->y + (int)y, p->width, p->data + (size_t)y * (size_t)p->width * 3);
}

static void resample_rows(const void *job, int64_t begin, int64_t end)
{
    const warp_job *j = job;
    for (int64_t i = begin; i < end; i++)
        resample(j->p, j->view, j->size, (int)i, j->to + (size_t)i * (size_t)j->size * 3);
}

ts_code io_warp(const io_photo_rows *photo, const io_view_of *view, int size, int threads, io_image *square,
                ts_status *st)
{
    part p = {0};
    *square = (io_image){0};
    if (!bounds(photo, view, &p)) return ts_fail(st, TS_INVALID, "the square is not in front of the camera");
    p.data = malloc((size_t)p.width * (size_t)p.height * 3 * sizeof *p.data);
    if (!p.data) return ts_fail(st, TS_NOMEM, "out of memory for %d x %d pixels", p.width, p.height);
    const ts_code code = io_image_create(square, size, size, 3, st);
    if (!code) {
        const warp_job j = {photo, &p, view, size, square->data};
        ts_for(threads, p.height, 1, read_rows, &j);
        ts_for(threads, size, 1, resample_rows, &j);
    }
    free(p.data);
    return code;
}
