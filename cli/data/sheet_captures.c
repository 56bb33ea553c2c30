#include "cli/data/sheet_captures.h"
#include "cli/cli.h"
#include "cli/data/new_set.h"
#include "data/capture.h"
#include "data/image/jpeg_write.h"
#include "data/rectify/paper_light.h"
#include "data/rectify/tag_sheet.h"
#include "render/render.h"
#include "tensor/maps.h"
#include "tensor/rng.h"
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#define PI 3.14159265358979323846
#define DEGREE (PI / 180)
#define FOCAL 26 /* mm on 35 mm film */
#define MM (1 / IO_SHEET_WINDOW)
#define READ_NOISE 0.002f
#define SHOT_NOISE 0.0002f

static const float black_ink[3] = {0.03f, 0.03f, 0.03f}, table[3] = {0.24f, 0.17f, 0.11f};
static const io_paper *const paper = &io_papers[0];

/* Looks from its place at a point of the plane, rolled about its axis. */
static void aim(io_pinhole *c, const double target[2], double roll)
{
    double ahead[3], along = 0, length = 0, size = 0;
    const double level[3] = {cos(roll), sin(roll), 0};
    for (int k = 0; k < 3; k++) ahead[k] = (k < 2 ? target[k] : 0) - c->at[k], size += ahead[k] * ahead[k];
    for (int k = 0; k < 3; k++) c->rotation[2][k] = ahead[k] / sqrt(size), along += level[k] * c->rotation[2][k];
    for (int k = 0; k < 3; k++)
        c->rotation[0][k] = level[k] - along * c->rotation[2][k], length += pow(c->rotation[0][k], 2);
    for (int k = 0; k < 3; k++) c->rotation[0][k] /= sqrt(length);
    for (int k = 0; k < 3; k++)
        c->rotation[1][k] = c->rotation[2][(k + 1) % 3] * c->rotation[0][(k + 2) % 3] -
            c->rotation[2][(k + 2) % 3] * c->rotation[0][(k + 1) % 3];
}

void cl_sheet_shots(uint64_t seed, uint64_t index, int width, cl_sheet_shot shot[CL_SHEET_SHOTS])
{
    ts_rng r = ts_rng_make(seed, TS_STREAM_SHEET, index);
    const int height = width * 3 / 4;
    const double lens = 1 + (double)ts_rng_range(&r, -0.02f, 0.02f), radial = (double)ts_rng_range(&r, -0.03f, 0.03f);
    const double first = (double)ts_rng_range(&r, 0, 6.2831853f);
    for (int k = 0; k < CL_SHEET_SHOTS; k++) {
        cl_sheet_shot *s = &shot[k];
        const double tilt = DEGREE * (double)(k ? ts_rng_range(&r, 15, 40) : ts_rng_range(&r, 0, 5));
        const double around = first + 2 * PI * k / (CL_SHEET_SHOTS - 1) + (double)ts_rng_range(&r, -0.3f, 0.3f);
        const double away = (double)ts_rng_range(&r, 210, 245) * MM;
        *s = (cl_sheet_shot){
            .camera = {width,
                       height,
                       lens * FOCAL / 43.266615305567875 * hypot(width, height),
                       radial,
                       {{0}},
                       {away * sin(tilt) * cos(around), away * sin(tilt) * sin(around), away * cos(tilt)}},
            .light = {20 * MM, 0, 0},
            .exposure = 0.6 * (1 + (double)ts_rng_range(&r, -0.3f, 0.3f))};
        const double right = (double)ts_rng_range(&r, -6, 6) * MM, up = (double)ts_rng_range(&r, -6, 6) * MM;
        aim(&s->camera, (double[2]){right, up}, (double)ts_rng_range(&r, -0.15f, 0.15f));
    }
}

static rd_view view_of(const cl_sheet_shot *s)
{
    rd_view v = {.kind = RD_POINT, .power = 1};
    for (int k = 0; k < 3; k++) {
        double light = s->camera.at[k];
        for (int i = 0; i < 3; i++) light += s->camera.rotation[i][k] * s->light[i];
        v.camera[k] = (float)s->camera.at[k];
        v.light[k] = (float)light;
    }
    return v;
}

typedef struct scene {
    const cl_sheet_shot *shot;
    const float *radiance; /* [size][size][3] of the window, of power 1 */
    int size;
    io_tag_image *black; /* [IO_SHEET_TAGS] */
    double centre[IO_SHEET_TAGS][2];
} scene;

/* What lies at a point beside the window. */
static const float *albedo_at(const scene *s, const double p[2])
{
    static const float white[3] = {(float)IO_SHEET_PAPER, (float)IO_SHEET_PAPER, (float)IO_SHEET_PAPER};
    if (fabs(p[0]) > paper->width / 2 * MM || fabs(p[1]) > paper->height / 2 * MM) return table;
    const double half = IO_TAG_CELLS / 2.0 * IO_TAG_CELL, out = fmax(fabs(p[0]), fabs(p[1]));
    if (out < IO_SHEET_RING - half || out > IO_SHEET_RING + half) return white;
    for (int id = 0; id < IO_SHEET_TAGS; id++) {
        const double x = (p[0] - s->centre[id][0] + half) / IO_TAG_CELL,
                     y = (s->centre[id][1] + half - p[1]) / IO_TAG_CELL;
        if (x >= 0 && y >= 0 && x < IO_TAG_CELLS && y < IO_TAG_CELLS)
            return s->black[id][(int)y][(int)x] ? black_ink : white;
    }
    return white;
}

static void window_at(const scene *s, const double p[2], float rgb[3])
{
    const double x = (p[0] + 0.5) * s->size - 0.5, y = (0.5 - p[1]) * s->size - 0.5;
    const int i = (int)floor(x), j = (int)floor(y), last = s->size - 1;
    const float fx = (float)(x - i), fy = (float)(y - j);
    const int left = i < 0 ? 0 : i, right = i < last ? i + 1 : last, top = j < 0 ? 0 : j, low = j < last ? j + 1 : last;
    const float *above = s->radiance + (size_t)top * (size_t)s->size * 3,
                *below = s->radiance + (size_t)low * (size_t)s->size * 3;
    for (int c = 0; c < 3; c++) {
        const float a = above[3 * left + c] + fx * (above[3 * right + c] - above[3 * left + c]);
        const float b = below[3 * left + c] + fx * (below[3 * right + c] - below[3 * left + c]);
        rgb[c] = a + fy * (b - a);
    }
}

/* The radiance that meets the picture at a pixel, power 1. */
static void look(const scene *s, double x, double y, float rgb[3])
{
    const io_pinhole *c = &s->shot->camera;
    double q[3] = {(x - c->width / 2) / c->focal, (y - c->height / 2) / c->focal, 1}, d[3], p[2];
    const double seen2 = q[0] * q[0] + q[1] * q[1];
    double scale = 1; /* of the undistorted tangent: scale (1 + radial seen2 scale^2) = 1, by Newton */
    for (int i = 0; i < 4; i++)
        scale -= (scale * (1 + c->radial * seen2 * scale * scale) - 1) / (1 + 3 * c->radial * seen2 * scale * scale);
    for (int k = 0; k < 2; k++) q[k] *= scale;
    for (int k = 0; k < 3; k++) d[k] = q[0] * c->rotation[0][k] + q[1] * c->rotation[1][k] + q[2] * c->rotation[2][k];
    for (int k = 0; k < 2; k++) p[k] = c->at[k] - d[k] * c->at[2] / d[2];
    if (fabs(p[0]) <= 0.5 && fabs(p[1]) <= 0.5) {
        window_at(s, p, rgb);
        return;
    }
    const float lit = (float)(io_paper_light(c, s->shot->light, p) / PI);
    const float *albedo = albedo_at(s, p);
    for (int k = 0; k < 3; k++) rgb[k] = albedo[k] * lit;
}

/* Row y as a phone's 8-bit codes. */
static void take_row(const scene *s, uint64_t seed, uint64_t index, int y, float gain, float *noise, uint8_t *codes)
{
    const int width = (int)s->shot->camera.width;
    ts_rng r = ts_rng_make(seed, TS_STREAM_SHEET, (index + 1) << 20 | (uint64_t)y);
    ts_rng_normals(&r, 3 * (int64_t)width, noise);
    for (int x = 0; x < width; x++) {
        float sum[3] = {0}, rgb[3];
        for (int k = 0; k < 4; k++) {
            look(s, x + 0.25 + 0.5 * (k & 1), y + 0.25 + 0.5 * (k >> 1), rgb);
            for (int c = 0; c < 3; c++) sum[c] += rgb[c] / 4;
        }
        for (int c = 0; c < 3; c++) {
            const float v = fminf(sum[c] * gain, 1);
            const float noisy = v + noise[3 * x + c] * sqrtf(READ_NOISE * READ_NOISE + SHOT_NOISE * v);
            codes[3 * x + c] = (uint8_t)(io_linear_to_srgb(fminf(fmaxf(noisy, 0), 1)) * 255 + 0.5f);
        }
    }
}

static ts_code take(const char *path, const scene *s, uint64_t seed, uint64_t index, int quality, ts_status *st)
{
    const int width = (int)s->shot->camera.width, height = (int)s->shot->camera.height;
    const double high = 220 * MM;
    const float gain = (float)(s->shot->exposure * PI * high * high / IO_SHEET_PAPER);
    uint8_t *codes = malloc((size_t)width * (size_t)height * 3);
    float *noise = malloc((size_t)width * 3 * sizeof *noise);
    ts_code code = codes && noise ? TS_OK : ts_fail(st, TS_NOMEM, "out of memory for %d x %d pixels", width, height);
    for (int y = 0; y < height && !code; y++)
        take_row(s, seed, index, y, gain, noise, codes + (size_t)y * (size_t)width * 3);
    if (!code) code = io_write_phone_jpeg(path, width, height, codes, quality, FOCAL, st);
    free(codes);
    free(noise);
    return code;
}

/* The photographs into the folder photos, what they are without faults into exact. */
static ts_code take_all(const char *photos, const char *exact_folder, const io_material *m, uint64_t seed,
                        uint64_t index, int width, int quality, ts_status *st)
{
    const size_t values = (size_t)m->size * (size_t)m->size * 3;
    char path[4096];
    cl_sheet_shot shot[CL_SHEET_SHOTS];
    io_tag_image black[IO_SHEET_TAGS];
    io_capture exact;
    float *radiance = malloc(values * sizeof *radiance);
    ts_code code = radiance ? io_tag_images(black, st) : ts_fail(st, TS_NOMEM, "out of memory");
    if (!code) code = io_capture_create(&exact, CL_SHEET_SHOTS, m->size, st);
    if (code) {
        free(radiance);
        return code;
    }
    cl_sheet_shots(seed, index, width, shot);
    exact.side = (float)(IO_SHEET_WINDOW / 10);
    for (int i = 0; i < CL_SHEET_SHOTS && !code; i++) {
        const rd_view view = view_of(&shot[i]);
        scene s = {.shot = &shot[i], .radiance = radiance, .size = m->size, .black = black};
        for (int id = 0; id < IO_SHEET_TAGS; id++) io_tag_centre(id, s.centre[id]);
        rd_render(rd_grid_full(m->size), m->maps, MAP_CHANNELS, &view, false, radiance);
        snprintf(path, sizeof path, "%s/photo_%d.jpg", photos, i + 1);
        code = take(path, &s, seed, index * CL_SHEET_SHOTS + (uint64_t)i, quality, st);
        /* as bright as the default flash makes the sample from nearer by than any of the lights: nothing is clipped
         * that is not under that flash */
        const float power = 3 * RD_FLASH_POWER / (RD_FLASH_DISTANCE * RD_FLASH_DISTANCE);
        memcpy(exact.camera[i], view.camera, sizeof view.camera);
        memcpy(exact.light[i], view.light, sizeof view.light);
        for (int c = 0; c < 3; c++) exact.power[c] = power;
        for (size_t k = 0; k < values; k++) exact.image[(size_t)i * values + k] = fminf(radiance[k] * power, 1);
    }
    if (!code) code = io_write_capture(exact_folder, &exact, st);
    io_capture_free(&exact);
    free(radiance);
    return code;
}

ts_code cl_write_sheet_captures(const char *folder, const io_material *m, uint64_t seed, uint64_t index, int width,
                                int quality, ts_status *st)
{
    enum { PHOTOS, EXACT, MAPS, SETS };
    static const char *const names[SETS] = {"", "/exact", "/maps"},
                             *const marks[SETS] = {NULL, "camera_pos.txt", "meta.txt"};
    char path[4096];
    cl_new_set set[SETS];
    int begun = 0;
    const bool there = access(folder, F_OK) == 0;
    ts_code code = cl_make_folder(folder, NULL, st);
    for (; begun < SETS && !code; begun += !code)
        code = snprintf(path, sizeof path, "%s%s", folder, names[begun]) < (int)sizeof path
            ? cl_new_set_begin(&set[begun], path, marks[begun], st)
            : ts_fail(st, TS_INVALID, "%s: the path is too long", folder);
    if (!code) code = io_write_maps(set[MAPS].hidden, m, IO_MAPS_ALL, false, st);
    if (!code) code = take_all(set[PHOTOS].hidden, set[EXACT].hidden, m, seed, index, width, quality, st);
    code = cl_new_sets_end(set, begun, code, st);
    if (code && !there) rmdir(folder); /* nothing came into it, or it stays */
    return code;
}
