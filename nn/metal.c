#include "nn/metal.h"
#include "nn/kind.h"
#include <string.h>

/* After the steps from maps as they are read, or of the other kind. */
static double misfit(nn_trial *t, bool other, bool metal, int steps)
{
    const int pixels = t->side * t->side;
    const ts_prior prior = nn_step_prior(t->photos->known, t->photos->given);
    memcpy(t->tried, t->r0, (size_t)(pixels * t->channels) * sizeof *t->tried);
    if (other) nn_change_kind(metal, pixels, t->channels, t->tried);
    return nn_trial_misfit(t, &prior, steps);
}

ts_code nn_tell_metal(rd_grid grid, const nn_photos *photos, const float *deviation, int steps, int channels, float *r0,
                      ts_status *st)
{
    nn_trial t;
    if (nn_trial_begin(grid, NN_METAL_SIDE, photos, deviation, channels, r0, &t, st)) return st->code;
    const bool metal = nn_is_metal((int64_t)t.side * t.side, channels, t.r0);
    if (misfit(&t, true, metal, steps) < NN_METAL_SURE * misfit(&t, false, metal, steps))
        nn_change_kind(metal, (int64_t)grid.side * grid.side, channels, r0);
    nn_trial_end(&t);
    return TS_OK;
}
