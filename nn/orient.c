/* g of a photograph in its orientations (docs/math.md, S1). */
#include "nn/layers.h"
#include "tensor/maps.h"
#include <string.h>

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

/* The normal of orientation k in the picture's axes: as source for positions, but with y up. */
static void normal_back(int k, const float *from, float to[2])
{
    const float x = k & 1 ? -from[0] : from[0], y = k & 2 ? -from[1] : from[1];
    to[0] = k & 4 ? -y : x;
    to[1] = k & 4 ? -x : y;
}

/* [1, S, S, channels]: the mean over orientations of from [count, S, S, channels], turned back; the vector in two
 * channels from vector on (-1: there is none) turns with it. */
static ag_value *mean_back(ag_tape *tape, const ag_value *from, int vector)
{
    const int count = from->t.shape.n, side = from->t.shape.h, channels = from->t.shape.c;
    const size_t pixels = (size_t)side * (size_t)side;
    ag_value *mean = ag_empty(tape, (ts_shape){1, side, side, channels});
    if (!mean) return NULL;
    memset(mean->t.data, 0, (size_t)ts_count(mean->t.shape) * sizeof(float));
    for (int k = 0; k < count; k++)
        for (int i = 0; i < side * side; i++) {
            int sy, sx;
            source(orientations[k], side, i / side, i % side, &sy, &sx);
            const float *x = from->t.data + ((size_t)k * pixels + (size_t)i) * (size_t)channels;
            float *to = mean->t.data + (size_t)(sy * side + sx) * (size_t)channels, turned[2];
            if (vector >= 0) normal_back(orientations[k], x + vector, turned);
            for (int c = 0; c < channels; c++) {
                const bool turns = vector >= 0 && (c == vector || c == vector + 1);
                to[c] += (turns ? turned[c - vector] : x[c]) / (float)count;
            }
        }
    return mean;
}

/* The same of the scene's numbers, of which two pairs are vectors. */
static ag_value *mean_scene(ag_tape *tape, const ag_value *from)
{
    ag_value *mean = ag_empty(tape, (ts_shape){1, 1, 1, from->t.shape.c});
    if (!mean) return NULL;
    memset(mean->t.data, 0, (size_t)from->t.shape.c * sizeof(float));
    for (int k = 0; k < from->t.shape.n; k++) {
        float x[2 * RD_SCENE_NUMBERS];
        memcpy(x, from->t.data + (size_t)k * 2 * RD_SCENE_NUMBERS, sizeof x);
        for (int v = RD_SCENE_LIGHT_X; v <= RD_SCENE_CAMERA_X; v += 2) {
            const float vector[2] = {x[v], x[v + 1]};
            normal_back(orientations[k], vector, x + v);
        }
        for (int c = 0; c < 2 * RD_SCENE_NUMBERS; c++) mean->t.data[c] += x[c] / (float)from->t.shape.n;
    }
    return mean;
}

bool nn_unet_oriented(ag_tape *tape, const nn_model *model, const ag_value *photo, ag_value *conditions, int count,
                      nn_guess *guess)
{
    if (!photo) return false;
    const int side = photo->t.shape.h, read = photo->t.shape.c;
    const size_t pixels = (size_t)side * (size_t)side;
    const ts_mark mark = ag_scope_begin(tape);
    ag_value *all = ag_empty(tape, (ts_shape){count, side, side, read});
    if (!all) return false;
    for (int k = 0; k < count; k++)
        for (int i = 0; i < side * side; i++) {
            int sy, sx;
            source(orientations[k], side, i / side, i % side, &sy, &sx);
            memcpy(all->t.data + ((size_t)k * pixels + (size_t)i) * (size_t)read,
                   photo->t.data + (size_t)(sy * side + sx) * (size_t)read, (size_t)read * sizeof(float));
        }
    if (!nn_unet(tape, model, all, conditions, guess)) return false;
    ag_value *keep[3] = {mean_back(tape, guess->maps, MAP_NORMAL),
                         guess->spread ? mean_back(tape, guess->spread, -1) : NULL,
                         guess->scene ? mean_scene(tape, guess->scene) : NULL};
    ag_scope_end(tape, mark, keep, 3);
    *guess = (nn_guess){keep[0], keep[1], keep[2]};
    return !ag_status(tape)->code;
}
