/* newton: Gauss and Newton's method on the maps of each pixel by itself, from R_0 or a constant, minimising the squared
 * error between the photographs and their re-renderings. */
#include "eval/methods/method.h"
#include "render/render.h"

static int steps(const ev_estimator *e) { return (int)ev_number(e, "steps"); }
static int photos(const ev_estimator *e) { return (int)ev_number(e, "photos"); }

static ts_code open(ev_estimator *e, ts_status *st)
{
    return ev_number(e, "start") == 0 ? ev_open_net(e, "model", st) : TS_OK;
}

static ts_code run(ev_estimator *e, const ev_case *c, ev_seen seen, void *user, ts_status *st)
{
    const int64_t pixels = (int64_t)c->size * c->size, count = pixels * MAP_CHANNELS;
    const float rate = (float)ev_number(e, "rate");
    const float *image[NN_MAX_IMAGES];
    float damping[MAP_CHANNELS];
    for (int k = 0; k < photos(e); k++) image[k] = c->image + k * pixels * 3;
    for (int i = 0; i < MAP_CHANNELS; i++) damping[i] = (float)ev_number(e, "damping") * (i >= MAP_SPECULAR ? 10 : 1);
    if (ev_block(e, (size_t)count, st) != TS_OK) return st->code;
    if ((e->net ? ev_start_r0(e, c, e->x, st) : ev_start_mean(c, e->x, st)) != TS_OK) return st->code;
    for (int t = 0; seen(t, e->x, MAP_CHANNELS, user) && t < steps(e); t++) {
        rd_newton_step(rd_grid_full(c->size), e->x, MAP_CHANNELS, c->input, image, photos(e), damping, e->gradient);
        for (int64_t i = 0; i < count; i++) e->x[i] += rate * e->gradient[i];
    }
    return TS_OK;
}

static const ev_setting settings[] = {
    {.key = "start",
     .type = EV_WORD,
     .words = "r0 constant",
     .initial = "r0",
     .grid = "r0 constant",
     .help = "R_0 of the model, or the mean of procedural materials"},
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
    {.key = "steps",
     .type = EV_WHOLE,
     .lo = 0,
     .hi = 100000,
     .initial = "6",
     .grid = "0 1 2 5 10 20 50 100",
     .steps = true,
     .help = "number of steps"},
    {.key = "photos",
     .type = EV_WHOLE,
     .lo = 1,
     .hi = RD_CAPTURE_VIEWS,
     .initial = "1",
     .help = "number of photographs"},
    EV_ORIENTATIONS,
    {.key = "model", .type = EV_WEIGHTS, .initial = "", .help = "weights for R_0 (default: the program's)"},
    {0}};
const ev_method ev_method_newton = {.name = "newton",
                                    .help = "Gauss-Newton steps on the maps of each pixel",
                                    .settings = settings,
                                    .steps = steps,
                                    .photos = photos,
                                    .open = open,
                                    .run = run};
