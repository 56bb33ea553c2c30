/* The mean of procedural materials. */
#include "data/materials/procedural.h"
#include "eval/methods/method_internal.h"
#include <string.h>

/* Of the training data: its first materials, small, since only their mean is wanted. */
ts_code ev_mean(float mean[MAP_CHANNELS], ts_status *st)
{
    enum { MATERIALS = 64, SIDE = 32 };
    static float known[MAP_CHANNELS];
    static bool done;
    const io_procedural source = {.seed = 1};
    double sum[MAP_CHANNELS] = {0};
    io_material m;
    if (!done && io_material_create(&m, SIDE, st) != TS_OK) return st->code;
    if (!done) {
        for (int i = 0; i < MATERIALS; i++) {
            io_procedural_make(&source, (uint64_t)i, &m);
            for (int p = 0; p < SIDE * SIDE * MAP_CHANNELS; p++)
                sum[p % MAP_CHANNELS] += (double)m.maps[p] / (MATERIALS * SIDE * SIDE);
        }
        for (int k = 0; k < MAP_CHANNELS; k++) known[k] = (float)sum[k];
        io_material_free(&m);
        done = true;
    }
    memcpy(mean, known, sizeof known);
    return TS_OK;
}

void ev_fill(const ev_case *c, const float mean[MAP_CHANNELS], float *maps)
{
    for (int64_t i = 0; i < (int64_t)c->size * c->size; i++)
        memcpy(maps + i * MAP_CHANNELS, mean, MAP_CHANNELS * sizeof *maps);
}

ts_code ev_start_mean(const ev_case *c, float *maps, ts_status *st)
{
    float mean[MAP_CHANNELS];
    if (ev_mean(mean, st) != TS_OK) return st->code;
    ev_fill(c, mean, maps);
    return TS_OK;
}
