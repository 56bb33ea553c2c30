/* The whole inference of one photograph at 256 x 256 with the default architecture. FLOP are those of the convolutions: the
 * rest (norms, resampling, the renderer's gradient) is what keeps the fraction of the peak below a convolution's. */
#include "bench/bench.h"
#include "nn/model.h"
#include "render/render.h"
#include <stdio.h>
#include <string.h>

enum { SIDE = 256 };

typedef struct subject {
    nn_model *model;
    ag_tape *tape;
    nn_input in;
    int steps;
    ag_value *maps; /* for a single step: R_t and what h carried so far */
    nn_state state;
} subject;

/* Multiplications and additions of the convolutions whose name starts with prefix. */
static double conv_flop(const nn_model *m, const char *prefix)
{
    double flop = 0;
    for (int i = 0; i < m->params; i++) {
        const nn_param *p = &m->param[i];
        if (p->rank != 4 || strncmp(p->name, prefix, strlen(prefix)) != 0) continue;
        int side = m->arch.g_size, level;
        if (sscanf(p->name, "g.down%d", &level) == 1) side >>= level;
        else if (sscanf(p->name, "g.up%d", &level) == 1) side >>= m->arch.g_levels - level;
        else if (p->name[0] == 'h') side = SIDE;
        flop += 2.0 * (double)p->count * side * side;
    }
    return flop;
}

static void whole(void *user)
{
    subject *s = user;
    ag_value *maps;
    const ts_mark mark = ag_scope_begin(s->tape);
    nn_lgd(s->tape, s->model, &s->in, s->steps, false, &maps, NULL, NULL);
    ag_scope_end(s->tape, mark, NULL, 0);
}

static void step(void *user)
{
    subject *s = user;
    nn_state state = s->state;
    const ts_mark mark = ag_scope_begin(s->tape);
    nn_refine(s->tape, s->model, &s->in, s->maps, &state);
    ag_scope_end(s->tape, mark, NULL, 0);
}

static void gradient(void *user)
{
    subject *s = user;
    const ts_mark mark = ag_scope_begin(s->tape);
    float *to = ts_arena_alloc(ag_arena(s->tape), (size_t)SIDE * SIDE * (size_t)s->maps->t.shape.c * sizeof *to);
    if (to) rd_flash_gradient(s->in.grid, s->maps->t.data, s->maps->t.shape.c, &s->in.view, s->in.image.data, 0.1, to, NULL);
    ag_scope_end(s->tape, mark, NULL, 0);
}

BENCH(infer)
{
    ts_status st = {0};
    const nn_arch arch = nn_arch_default();
    char label[96];
    subject s = {.model = nn_model_create(&arch, &st), .tape = ag_tape_create(false, &st)};
    if (!s.model || !s.tape) {
        printf("infer: %s\n", st.message);
        nn_model_free(&s.model);
        ag_tape_destroy(&s.tape);
        return;
    }
    nn_model_init(s.model, 1);
    ag_freeze(s.tape, true);
    s.in = (nn_input){.image = ts_new(ag_arena(s.tape), (ts_shape){1, SIDE, SIDE, 3}), .grid = rd_grid_full(SIDE), .view = rd_flash()};
    ts_rng rng = ts_rng_make(1, TS_STREAM_TEST, 0);
    for (int i = 0; i < SIDE * SIDE * 3; i++) s.in.image.data[i] = ts_rng_range(&rng, 0.1f, 0.9f);
    s.maps = nn_predict(s.tape, s.model, &s.in);
    s.maps = nn_refine(s.tape, s.model, &s.in, s.maps, &s.state);

    bench_heading("inference, 256 x 256, default architecture");
    const double g = conv_flop(s.model, "g."), h = conv_flop(s.model, "h."), unused = conv_flop(s.model, "h.gru1.hh") + conv_flop(s.model, "h.gru2.hh");
    snprintf(label, sizeof label, "g at %d x %d and its maps resampled", arch.g_size, arch.g_size);
    bench_row(label, bench_measure(whole, &s), g);
    bench_row("one step of h with its gradient", bench_measure(step, &s), h);
    bench_time t = bench_measure(gradient, &s);
    bench_row_unit("  of which the renderer's gradient", t, SIDE * SIDE / t.seconds * 1e-6, "Mpixel/s");
    s.steps = arch.iterations;
    snprintf(label, sizeof label, "g and %d steps", s.steps);
    bench_row(label, bench_measure(whole, &s), g + s.steps * h - unused); /* the first step has no states to multiply */
    if (ag_status(s.tape)->code) printf("infer: %s\n", ag_status(s.tape)->message);
    ag_tape_destroy(&s.tape);
    nn_model_free(&s.model);
}
