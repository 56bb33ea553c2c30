/* descent: Adam on the maps themselves, minimising the squared error between the photographs and their re-renderings
 * (the paper's equation 3). */
#include "eval/methods/method_internal.h"
#include "render/render.h"
#include <stdlib.h>

static ts_code open(ev_estimator *e, ts_status *st) { return ev_open_start(e, "model", st); }

/* The sum over the photographs of d (error^2 / 2) / d maps, but for a factor that is the same for all: Adam does not
 * see it. part: a buffer for one's. */
static void gradient(ev_estimator *e, const ev_case *c, float *part)
{
    const int64_t pixels = (int64_t)c->size * c->size, count = pixels * MAP_CHANNELS;
    for (int k = 0; k < ev_inputs(e, c); k++) {
        float *to = k ? part : e->gradient;
        rd_flash_gradient(rd_grid_full(c->size), e->x, MAP_CHANNELS, &c->input[k], c->image + k * pixels * 3, 1, to,
                          NULL);
        for (int64_t i = 0; k && i < count; i++) e->gradient[i] += part[i];
    }
}

static ts_code run(ev_estimator *e, const ev_case *c, ev_seen seen, void *user, ts_status *st)
{
    const int64_t count = (int64_t)c->size * c->size * MAP_CHANNELS;
    const float rate = (float)ev_number(e, "rate");
    if (ev_block(e, (size_t)count, st) != TS_OK) return st->code;
    if (ev_start(e, c, e->x, st) != TS_OK) return st->code;
    float *part = ev_inputs(e, c) > 1 ? malloc((size_t)count * sizeof *part) : NULL;
    if (ev_inputs(e, c) > 1 && !part)
        return ts_fail(st, TS_NOMEM, "no memory for the gradient of %d x %d pixels", c->size, c->size);
    for (int t = 0; seen(t, e->x, MAP_CHANNELS, user) && t < ev_steps(e); t++) {
        gradient(e, c, part);
        ev_block_step(e, rate);
        /* Beyond its range a value has no gradient that would bring it back. */
        for (int64_t i = 0; i < count; i++) e->x[i] = e->x[i] < -1 ? -1 : e->x[i] > 1 ? 1 : e->x[i];
    }
    free(part);
    return TS_OK;
}

static const ev_setting settings[] = {EV_START_MAPS,
                                      EV_ADAM_RATE("0.01", "0.001 0.003 0.01 0.03 0.1"),
                                      EV_STEPS("100", "0 1 2 5 10 20 50 100 200 500"),
                                      EV_PHOTOS,
                                      EV_ORIENTATIONS,
                                      EV_MODEL_R0("model"),
                                      {0}};
const ev_method ev_method_descent = {.name = "descent",
                                     .help = "Adam on the maps (equation 3)",
                                     .settings = settings,
                                     .sampled = true,
                                     .steps = ev_steps,
                                     .photos = ev_photos,
                                     .open = open,
                                     .run = run};
