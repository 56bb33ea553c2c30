/* finetune: Adam on g's weights for each photograph, minimising the RMSE between it and the re-rendering of g's maps
 * (the paper's equation 6). */
#include "eval/methods/method_internal.h"
#include "render/losses.h"
#include "tensor/memory.h"
#include <string.h>

static ts_code open(ev_estimator *e, ts_status *st)
{
    if (ev_open_net(e, "model", st) != TS_OK || ev_open_train(e, st) != TS_OK || nn_model_train(e->net, st) != TS_OK ||
        nn_adam_create(&e->adam, e->net, 0, st) != TS_OK)
        return st->code;
    ag_freeze(e->tape, false); /* the weights change */
    e->bytes = e->net->count * sizeof *e->kept;
    e->kept = ts_memory(e->bytes);
    if (!e->kept) return ts_fail(st, TS_NOMEM, "out of memory for a copy of the weights");
    memcpy(e->kept, e->net->value, e->bytes);
    return TS_OK;
}

static ts_code run(ev_estimator *e, const ev_case *c, ev_seen seen, void *user, ts_status *st)
{
    const float rate = (float)ev_number(e, "rate");
    const nn_input in = {.image = ts_view((float *)(uintptr_t)c->image, (ts_shape){1, c->size, c->size, 3}),
                         .grid = rd_grid_full(c->size),
                         .view = c->view};
    size_t first, last;
    nn_model_range(e->net, NN_G, &first, &last);
    memset(e->adam.m, 0, e->adam.count * sizeof *e->adam.m);
    memset(e->adam.v, 0, e->adam.count * sizeof *e->adam.v);
    e->adam.step = 0;
    bool on = true;
    for (int t = 0; on && t <= ev_steps(e); t++) {
        ag_reset(e->train);
        ag_value *maps = nn_predict(e->train, e->net, &in);
        on = maps && seen(t, maps->t.data, maps->t.shape.c, user) && t < ev_steps(e);
        if (!on) break;
        ag_value *loss = ag_flash_loss(e->train, maps, ag_constant(e->train, in.image), &c->view);
        on = loss && ag_backward(e->train, loss) == TS_OK;
        nn_adam_next(&e->adam);
        if (on) nn_adam_step(&e->adam, e->net, first, last, rate, 1);
    }
    *st = *ag_status(e->train);
    memcpy(e->net->value, e->kept, e->net->count * sizeof *e->kept); /* the next photograph begins anew */
    memset(e->net->grad, 0, e->net->count * sizeof *e->kept);
    return st->code;
}

static const ev_setting settings[] = {EV_ADAM_RATE("0.0001", "0.00001 0.00003 0.0001 0.0003 0.001"),
                                      EV_STEPS("20", "0 1 2 5 10 20 50 100"),
                                      EV_MODEL("model", "weights whose g is tuned (default: the program's)"),
                                      {0}};
const ev_method ev_method_finetune = {.name = "finetune",
                                      .help = "Adam on g's weights at test time (equation 6)",
                                      .settings = settings,
                                      .sampled = true,
                                      .steps = ev_steps,
                                      .open = open,
                                      .run = run};
