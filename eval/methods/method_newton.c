/* newton: Gauss and Newton's method on the maps of each pixel by itself, from R_0 or a constant, minimising the squared
 * error between the photographs and their re-renderings. */
#include "eval/methods/method_internal.h"
#include "render/render.h"

static ts_code open(ev_estimator *e, ts_status *st) { return ev_open_start(e, "model", st); }

static ts_code run(ev_estimator *e, const ev_case *c, ev_seen seen, void *user, ts_status *st)
{
    const int64_t pixels = (int64_t)c->size * c->size, count = pixels * MAP_CHANNELS;
    const int inputs = ev_inputs(e, c);
    const float rate = (float)ev_number(e, "rate");
    const float *image[NN_MAX_IMAGES];
    float damping[MAP_CHANNELS];
    for (int k = 0; k < inputs; k++) image[k] = c->image + k * pixels * 3;
    for (int i = 0; i < MAP_CHANNELS; i++) damping[i] = (float)ev_number(e, "damping") * (i >= MAP_SPECULAR ? 10 : 1);
    if (ev_block(e, (size_t)count, st) != TS_OK) return st->code;
    if (ev_start(e, c, e->x, st) != TS_OK) return st->code;
    for (int t = 0; seen(t, e->x, MAP_CHANNELS, user) && t < ev_steps(e); t++) {
        rd_newton_step(rd_grid_full(c->size), e->x, MAP_CHANNELS, c->input, image, inputs, damping, e->gradient);
        for (int64_t i = 0; i < count; i++) e->x[i] += rate * e->gradient[i];
    }
    return TS_OK;
}

static const ev_setting settings[] = {
    EV_START_MAPS,
    {.key = "damping",
     .type = EV_REAL,
     .lo = 1e-6,
     .hi = 1e6,
     .initial = "0.1",
     .grid = "0.01 0.03 0.1 0.3 1",
     .help = "added to the diagonal of the normal equations, ten times as much for F0"},
    {.key = "rate",
     .type = EV_REAL,
     .lo = 0,
     .hi = 1,
     .initial = "0.5",
     .grid = "0.1 0.2 0.5 1",
     .help = "the part of each step that is taken"},
    EV_STEPS("6", "0 1 2 5 10 20 50 100"),
    EV_PHOTOS,
    EV_ORIENTATIONS,
    EV_MODEL_R0("model"),
    {0}};
const ev_method ev_method_newton = {.name = "newton",
                                    .help = "Gauss-Newton steps on the maps of each pixel",
                                    .settings = settings,
                                    .steps = ev_steps,
                                    .photos = ev_photos,
                                    .open = open,
                                    .run = run};
