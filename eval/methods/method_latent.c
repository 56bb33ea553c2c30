/* latent: Adam in the code of an auto-encoder of maps, minimising the RMSE between photograph and re-rendering (the
 * paper's equation 5). */
#include "eval/methods/method_internal.h"
#include "nn/weights/weights.h"
#include "render/losses.h"
#include <string.h>

static ts_code open(ev_estimator *e, ts_status *st)
{
    const char *path = ev_text(e, "model");
    e->coder = nn_coder_load(path, st);
    if (!e->coder) return st->code;
    if (ev_open_start(e, "g", st) != TS_OK) return st->code;
    if (ev_open_train(e, st) != TS_OK) return st->code;
    ag_freeze(e->train, true); /* only the code changes */
    return TS_OK;
}

/* e->x = the code of the start. */
static ts_code encode(ev_estimator *e, const ev_case *c, float *maps, ts_status *st)
{
    const ts_shape s = {1, c->size, c->size, MAP_CHANNELS};
    if (ev_start(e, c, maps, st) != TS_OK) return st->code;
    ag_reset(e->train);
    const ag_value *code = nn_encode(e->train, e->coder, ag_constant(e->train, ts_view(maps, s)));
    if (!code) {
        *st = *ag_status(e->train);
        return st->code;
    }
    const size_t count = (size_t)ts_count(code->t.shape);
    if (ev_block(e, count, st) != TS_OK) return st->code;
    memcpy(e->x, code->t.data, count * sizeof *e->x);
    return TS_OK;
}

static ts_code run(ev_estimator *e, const ev_case *c, ev_seen seen, void *user, ts_status *st)
{
    const float rate = (float)ev_number(e, "rate");
    ts_arena *arena = ts_arena_create(0, st);
    float *maps = arena ? ts_arena_alloc(arena, (size_t)c->size * (size_t)c->size * MAP_CHANNELS * sizeof *maps) : NULL;
    ts_code code = maps ? encode(e, c, maps, st)
                        : ts_fail(st, TS_NOMEM, "out of memory for %d x %d pixels", c->size, c->size);
    ts_arena_destroy(&arena);
    if (code) return code;
    const int side = c->size >> e->coder->coder.levels;
    const ts_tensor image = ts_view((float *)(uintptr_t)c->image, (ts_shape){1, c->size, c->size, 3}),
                    x = ts_view(e->x, (ts_shape){1, side, side, e->coder->coder.code});
    bool on = true;
    for (int t = 0; on && t <= ev_steps(e); t++) {
        ag_reset(e->train);
        ag_value *decoded = nn_decode(e->train, e->coder, ag_parameter(e->train, x, e->gradient));
        on = decoded && seen(t, decoded->t.data, decoded->t.shape.c, user) && t < ev_steps(e);
        if (!on) break;
        ag_value *loss = ag_flash_loss(e->train, decoded, ag_constant(e->train, image), &c->view);
        on = loss && ag_backward(e->train, loss) == TS_OK;
        if (on) ev_block_step(e, rate);
    }
    *st = *ag_status(e->train);
    return st->code;
}

static const ev_setting settings[] = {
    EV_START("the code of g's R_0, or of the mean of procedural materials"),
    EV_ADAM_RATE("0.03", "0.0003 0.001 0.003 0.01 0.03 0.1"),
    EV_STEPS("50", "0 1 2 5 10 20 50 100 200"),
    {.key = "model", .type = EV_WEIGHTS, .help = "weights of an auto-encoder (configs/ablation/latent.ini trains one)"},
    EV_MODEL_R0("g"),
    {0}};
const ev_method ev_method_latent = {.name = "latent",
                                    .help = "Adam in an auto-encoder's code (equation 5)",
                                    .settings = settings,
                                    .sampled = true,
                                    .steps = ev_steps,
                                    .open = open,
                                    .run = run};
