/* g of a photograph in its orientations (docs/math.md, S1). */
#include "nn/lgd_internal.h"
#include "tensor/maps.h"
#include "tensor/team.h"
#include <string.h>

enum { ROWS = 8 }; /* of pixels at a time, at least */

/* As it is, a quarter turn, the other turns, and all of these mirrored. The first 1, 4 and 8 are groups, so that their
 * mean turns with the photograph; the first 2 are not (docs/training.md, Orientations). */
static const int orientations[8] = {0, 5, 3, 6, 1, 2, 4, 7};

/* The pixel (*from_y, *from_x) of a picture that orientation k of it has at (y, x): mirrored in x, in y, and
 * transposed, a bit of k each. */
static void source(int k, int side, int y, int x, int *from_y, int *from_x)
{
    if (k & 1) x = side - 1 - x;
    if (k & 2) y = side - 1 - y;
    *from_y = k & 4 ? x : y;
    *from_x = k & 4 ? y : x;
}

/* The pixel (*at_y, *at_x) of orientation k of a picture that the picture has at (y, x). */
static void place(int k, int side, int y, int x, int *at_y, int *at_x)
{
    *at_y = k & 4 ? x : y;
    *at_x = k & 4 ? y : x;
    if (k & 1) *at_x = side - 1 - *at_x;
    if (k & 2) *at_y = side - 1 - *at_y;
}

/* The normal of orientation k in the picture's axes: as source for positions, but with y up. */
static void normal_back(int k, const float *from, float to[2])
{
    const float x = k & 1 ? -from[0] : from[0], y = k & 2 ? -from[1] : from[1];
    to[0] = k & 4 ? -y : x;
    to[1] = k & 4 ? -x : y;
}

typedef struct turn_job {
    const float *from;
    int count, side, channels, vector;
    float *to;
} turn_job;

/* A row of orientation k turned back, times part, into to or added to it. from: its first pixel, next: from pixel to
 * pixel. */
static inline __attribute__((always_inline)) void turn_back_row(const turn_job *j, int k, const float *from,
                                                                ptrdiff_t next, const int channels, const bool add,
                                                                float *to)
{
    const float part = 1 / (float)j->count; /* a power of two */
    const int v = j->vector;
    for (int x = 0; x < j->side; x++, from += next, to += channels) {
        float turned[2], old[2] = {0};
        if (v >= 0) {
            normal_back(k, from + v, turned);
            if (add) memcpy(old, to + v, sizeof old);
        }
        for (int c = 0; c < channels; c++) to[c] = add ? to[c] + from[c] * part : from[c] * part;
        for (int c = 0; c < 2 && v >= 0; c++) to[v + c] = add ? old[c] + turned[c] * part : turned[c] * part;
    }
}

static void turn_back_rows(const void *job, int64_t begin, int64_t end)
{
    const turn_job *j = job;
    const int side = j->side, channels = j->channels;
    for (int64_t i = begin; i < end; i++)
        for (int n = 0; n < j->count; n++) {
            const int k = orientations[n];
            int y, x;
            place(k, side, (int)i, 0, &y, &x);
            const float *from = j->from + (((int64_t)n * side + y) * side + x) * channels;
            const ptrdiff_t next = (ptrdiff_t)(k & 4 ? (k & 2 ? -side : side) : k & 1 ? -1 : 1) * channels;
            float *to = j->to + i * side * channels;
            /* Loops of a known length: those of the maps and of their errors. */
            if (channels == MAP_CHANNELS && n) turn_back_row(j, k, from, next, MAP_CHANNELS, true, to);
            else if (channels == MAP_CHANNELS) turn_back_row(j, k, from, next, MAP_CHANNELS, false, to);
            else if (channels == NN_SPREADS && n) turn_back_row(j, k, from, next, NN_SPREADS, true, to);
            else turn_back_row(j, k, from, next, channels, n > 0, to);
        }
}

/* [1, S, S, channels]: the mean over orientations of from [count, S, S, channels], turned back; the vector in two
 * channels from vector on (-1: there is none) turns with it. */
static ag_value *mean_back(ag_tape *tape, const ag_value *from, int vector)
{
    const int count = from->t.shape.n, side = from->t.shape.h, channels = from->t.shape.c;
    ag_value *mean = ag_empty(tape, (ts_shape){1, side, side, channels});
    if (mean)
        ts_for(ag_compute(tape)->threads, side, ROWS, turn_back_rows,
               &(turn_job){from->t.data, count, side, channels, vector, mean->t.data});
    return mean;
}

/* The same of the scene's numbers of each telling, of which two pairs are vectors. */
static ag_value *mean_scene(ag_tape *tape, const ag_value *from, int tellings)
{
    const int count = from->t.shape.n / tellings;
    ag_value *mean = ag_empty(tape, (ts_shape){tellings, 1, 1, from->t.shape.c});
    if (!mean) return NULL;
    memset(mean->t.data, 0, (size_t)ts_count(mean->t.shape) * sizeof(float));
    for (int i = 0; i < from->t.shape.n; i++) {
        const int k = orientations[i % count];
        float x[2 * RD_SCENE_NUMBERS], *to = mean->t.data + (size_t)(i / count) * 2 * RD_SCENE_NUMBERS;
        memcpy(x, from->t.data + (size_t)i * 2 * RD_SCENE_NUMBERS, sizeof x);
        for (int v = RD_SCENE_LIGHT_X; v <= RD_SCENE_CAMERA_X; v += 2) {
            const float vector[2] = {x[v], x[v + 1]};
            normal_back(k, vector, x + v);
            if (!(k & 4)) continue; /* x and y have changed places, and so have their errors */
            const float error = x[RD_SCENE_NUMBERS + v];
            x[RD_SCENE_NUMBERS + v] = x[RD_SCENE_NUMBERS + v + 1];
            x[RD_SCENE_NUMBERS + v + 1] = error;
        }
        for (int c = 0; c < 2 * RD_SCENE_NUMBERS; c++) to[c] += x[c] / (float)count;
    }
    return mean;
}

static void turn_rows(const void *job, int64_t begin, int64_t end)
{
    const turn_job *j = job;
    const int side = j->side, channels = j->channels;
    for (int64_t i = begin * side; i < end * side; i++) {
        const int at = (int)(i % ((int64_t)side * side));
        int y, x;
        source(orientations[i / side / side], side, at / side, at % side, &y, &x);
        memcpy(j->to + i * channels, j->from + ((int64_t)y * side + x) * channels, (size_t)channels * sizeof(float));
    }
}

bool nn_unet_oriented(ag_tape *tape, const nn_model *model, const ag_value *photo, ag_value *conditions,
                      const nn_input *in, int count, nn_guess *guess)
{
    if (!photo) return false;
    const int side = photo->t.shape.h, read = photo->t.shape.c;
    const ts_mark mark = ag_scope_begin(tape);
    ag_value *all = ag_empty(tape, (ts_shape){count, side, side, read});
    if (!all) return false;
    ts_for(ag_compute(tape)->threads, (int64_t)count * side, ROWS, turn_rows,
           &(turn_job){.from = photo->t.data, .side = side, .channels = read, .to = all->t.data});
    if (!nn_unet(tape, model, all, conditions, in, guess)) return false;
    ag_value *keep[3] = {mean_back(tape, guess->maps, MAP_NORMAL),
                         guess->spread ? mean_back(tape, guess->spread, -1) : NULL,
                         guess->scene ? mean_scene(tape, guess->scene, nn_times_told(in)) : NULL};
    ag_scope_end(tape, mark, keep, 3);
    *guess = (nn_guess){keep[0], keep[1], keep[2]};
    return !ag_status(tape)->code;
}
