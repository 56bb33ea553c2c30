/* What is known of the photographs' scenes, as channels for g. */
#include "nn/lgd_internal.h"
#include <math.h>
#include <string.h>

/* The direction's x and y and 1 for each pixel, from channel on. */
static void towards(const float place[3], rd_grid grid, int channels, float *to)
{
    for (int y = 0; y < grid.h; y++)
        for (int x = 0; x < grid.w; x++, to += channels) {
            const float dx = place[0] - (((float)x + 0.5f) / (float)grid.side - 0.5f),
                        dy = place[1] - (0.5f - ((float)y + 0.5f) / (float)grid.side);
            const float inverse = 1 / sqrtf(dx * dx + dy * dy + place[2] * place[2]);
            to[0] = dx * inverse;
            to[1] = dy * inverse;
            to[2] = 1;
        }
}

ag_value *nn_conditions(ag_tape *tape, const nn_model *model, const nn_input *in)
{
    const int images = model->arch.images, size = model->arch.g_size, count = nn_given(in),
              n = nn_times_told(in) * nn_materials(in);
    const int channels = NN_CONDITIONS * images;
    const int64_t pixels = (int64_t)size * size;
    ag_value *v = ag_empty(tape, (ts_shape){n, size, size, channels});
    if (!v) return NULL;
    memset(v->t.data, 0, (size_t)ts_count(v->t.shape) * sizeof(float));
    for (int i = 0; i < n * count; i++) {
        const int known = in->known ? in->known[i] : NN_KNOWN_ALL;
        const rd_view view = nn_view_of(model, in, i);
        float number[RD_SCENE_NUMBERS], *to = v->t.data + i / count * pixels * channels + i % count * NN_CONDITIONS;
        rd_scene_numbers(&view, 0, 0, number);
        if (known & NN_KNOWN_CAMERA) towards(view.camera, rd_grid_full(size), channels, to);
        if (known & NN_KNOWN_LIGHT) towards(view.light, rd_grid_full(size), channels, to + 3);
        for (int64_t p = 0; p < pixels && known & NN_KNOWN_POWER; p++) {
            to[p * channels + 6] = number[RD_SCENE_EXPOSURE];
            to[p * channels + 7] = 1;
        }
    }
    return v;
}
