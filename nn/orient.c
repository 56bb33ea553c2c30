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

ag_value *nn_unet_oriented(ag_tape *tape, const nn_model *model, const ag_value *x, int count)
{
    if (!x) return NULL;
    const int side = x->t.shape.h, read = x->t.shape.c, channels = model->arch.channels;
    const size_t pixels = (size_t)side * (size_t)side;
    ag_value *mean = ag_empty(tape, (ts_shape){1, side, side, channels});
    const ts_mark mark = ag_scope_begin(tape);
    ag_value *all = ag_empty(tape, (ts_shape){count, side, side, read});
    if (!all || !mean) return NULL;
    int sy, sx;
    for (int k = 0; k < count; k++)
        for (int i = 0; i < side * side; i++) {
            source(orientations[k], side, i / side, i % side, &sy, &sx);
            memcpy(all->t.data + ((size_t)k * pixels + (size_t)i) * (size_t)read,
                   x->t.data + (size_t)(sy * side + sx) * (size_t)read, (size_t)read * sizeof(float));
        }
    const ag_value *maps = nn_unet(tape, model, all);
    if (!maps) return NULL;
    memset(mean->t.data, 0, (size_t)ts_count(mean->t.shape) * sizeof(float));
    for (int k = 0; k < count; k++)
        for (int i = 0; i < side * side; i++) {
            source(orientations[k], side, i / side, i % side, &sy, &sx);
            const float *from = maps->t.data + ((size_t)k * pixels + (size_t)i) * (size_t)channels;
            float *to = mean->t.data + (size_t)(sy * side + sx) * (size_t)channels, normal[2];
            normal_back(orientations[k], from + MAP_NORMAL, normal);
            for (int c = 0; c < channels; c++) {
                const bool turns = c == MAP_NORMAL || c == MAP_NORMAL + 1;
                to[c] += (turns ? normal[c - MAP_NORMAL] : from[c]) / (float)count;
            }
        }
    ag_scope_end(tape, mark, NULL, 0);
    return mean;
}
