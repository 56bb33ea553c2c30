/* The whole inference of one photograph at 256 x 256 with the default architecture. FLOP are those of the convolutions:
 * the rest (norms, resampling, the renderer's gradient) is what keeps the fraction of the peak below a convolution's.
 */
#include "bench/bench.h"
#include "bench/shape.h"
#include "infer/estimate.h"
#include "nn/weights/file.h"
#include "nn/weights/weights.h"
#include "render/render.h"
#include "tensor/maps.h"
#include "tensor/threads.h"
#include <stdio.h>
#include <string.h>

enum { SIDE = 256 };

typedef struct subject {
    nn_model *model;
    ag_tape *tape, *own; /* the estimator's, and that of a single step */
    nn_input in;
    lgd_options options;
    ts_status st;
    ag_value *maps; /* for a single step: R_t and what h carried so far */
    nn_state state;
} subject;

static void whole(void *user)
{
    subject *s = user;
    const lgd_estimator e = {.net = s->model, .tape = s->tape, .encoded = true};
    const lgd_photo photo = lgd_flash_photo(s->in.image.data);
    static float maps[SIDE * SIDE * MAP_CHANNELS];
    s->options.threads = ts_threads();
    lgd_estimator_run(&e, &photo, 1, SIDE, &s->options, maps, &s->st);
}

/* The estimate without what the estimator adds: the photograph clipped, the maps made the caller's. */
static void network(void *user)
{
    subject *s = user;
    ag_value *maps;
    const ts_mark mark = ag_scope_begin(s->own);
    ag_compute_set(s->own, *ag_compute(s->tape));
    nn_lgd(s->own, s->model, &s->in, s->options.iterations, false, &maps, NULL);
    ag_scope_end(s->own, mark, NULL, 0);
}

static void step(void *user)
{
    subject *s = user;
    nn_state state = s->state;
    const ts_mark mark = ag_scope_begin(s->own);
    nn_refine(s->own, s->model, &s->in, s->maps, &state);
    ag_scope_end(s->own, mark, NULL, 0);
}

static void gradient(void *user)
{
    subject *s = user;
    const ts_mark mark = ag_scope_begin(s->own);
    float *to = ts_arena_alloc(ag_arena(s->own), (size_t)SIDE * SIDE * (size_t)s->maps->t.shape.c * sizeof *to);
    if (to)
        rd_flash_gradient(s->in.grid, s->maps->t.data, s->maps->t.shape.c, &s->in.view, s->in.image.data, 0.1, to,
                          NULL);
    ag_scope_end(s->own, mark, NULL, 0);
}

/* compat: what the estimator and g take the layers for. The peers stand beside the way that lgd-infer takes. */
static void measure(nn_arch arch, nn_compat compat, const char *heading)
{
    enum { ROUNDED = 5 };
    char label[128], job[256] = "bf16 ";
    subject s = {.options = {.size = sizeof(lgd_options), .exact = 1, .orientations = 1}}; /* as the peers */
    s.model = nn_model_create(&arch, &s.st);
    s.tape = ag_tape_create(false, &s.st);
    s.own = ag_tape_create(false, &s.st);
    bench_heading(heading);
    if (!s.model || !s.tape || !s.own) {
        printf("  %s\n", s.st.message);
        nn_model_free(&s.model);
        ag_tape_destroy(&s.tape);
        ag_tape_destroy(&s.own);
        return;
    }
    s.model->arch.compat = compat; /* only now: the layers have our names, which bench_network_flop reads */
    nn_model_init(s.model, 1);
    ag_freeze(s.tape, true);
    ag_freeze(s.own, true);
    static float image[SIDE * SIDE * 3];
    for (int i = 0; i < SIDE * SIDE * 3; i++) image[i] = (float)(i % 97) / 97;
    s.in = (nn_input){
        .image = ts_view(image, (ts_shape){1, SIDE, SIDE, 3}), .grid = rd_grid_full(SIDE), .view = rd_flash()};
    s.maps = nn_predict(s.own, s.model, &s.in);
    s.maps = nn_refine(s.own, s.model, &s.in, s.maps, &s.state);

    const double g = bench_network_flop(s.model, "g.", SIDE), h = bench_network_flop(s.model, "h.", SIDE);
    const double unused = bench_network_flop(s.model, "h.gru1.hh", SIDE) +
        bench_network_flop(s.model, "h.gru2.hh", SIDE); /* without states */
    const double step_flop = arch.recurrent ? h : h - unused,
                 coarse = arch.coarse_steps * bench_network_flop(s.model, "coarse.", SIDE);
    snprintf(label, sizeof label, "g at %d x %d and its maps resampled", arch.g_size, arch.g_size);
    bench_row(label, bench_measure(whole, &s), g);
    if (arch.coarse_steps > 0) {
        s.options.iterations = arch.coarse_steps;
        snprintf(label, sizeof label, "g and %d coarse steps", arch.coarse_steps);
        bench_row(label, bench_measure(whole, &s), g + coarse);
    }
    bench_row(arch.h_width ? "one step of h with its gradient" : "one step at the photograph's size",
              bench_measure(step, &s), step_flop);
    bench_time t = bench_measure(gradient, &s);
    bench_row_unit("  of which the renderer's gradient", t, SIDE * SIDE / t.seconds * 1e-6, "Mpixel/s");
    const int steps = s.options.iterations = arch.iterations;
    const double flop = g + coarse + (steps - arch.coarse_steps) * h - (arch.recurrent ? 1 : steps) * unused;
    bench_peer_network("infer", &arch, steps, job + ROUNDED, sizeof job - ROUNDED);
    snprintf(job + strlen(job), sizeof job - strlen(job), " %d", SIDE);
    for (int exact = 1; exact >= 0; exact--) {
        s.options.exact = exact;
        snprintf(label, sizeof label, "g and %d steps, %s", steps, exact ? "direct" : "Winograd where it wins");
        t = bench_measure(whole, &s);
        bench_row(label, t, flop);
        if (!exact) bench_row_peers(t, flop, job + ROUNDED);
        if (exact) bench_row_threads(whole, &s);
        bench_row("  of which g and the steps", bench_measure(network, &s), flop);
    }
    s.options.precision = LGD_BF16;
    t = bench_measure(whole, &s);
    snprintf(label, sizeof label, "g and %d steps, bf16%s", steps, bench_bf16(&t) ? "" : ", emulated");
    bench_row(label, t, flop);
    bench_row_peers(t, flop, job);
    if (s.st.code) printf("  %s\n", s.st.message);
    ag_tape_destroy(&s.tape);
    ag_tape_destroy(&s.own);
    nn_model_free(&s.model);
}

BENCH(infer) { measure(nn_arch_default(), NN_COMPAT_NONE, "inference, 256 x 256, default architecture"); }

/* The shipped model's, whose Newton steps the peers do not have. */
BENCH(infer_shipped)
{
    ts_status st = {0};
    nn_arch a;
    nn_file *file = nn_file_open("models/single.safetensors", &st);
    if (!file || nn_arch_from_file(file, &a, &st)) printf("  %s\n", st.message);
    else measure(a, NN_COMPAT_NONE, "inference, 256 x 256, the architecture of models/single.safetensors");
    nn_file_close(&file);
}

/* The published networks with random weights. */
BENCH(infer_paper)
{
    nn_arch a = nn_arch_default();
    a.channels = 10, a.g_width = 64, a.g_width_max = 512, a.g_levels = 7, a.g_kernel_first = 3, a.g_kernel = 5,
    a.g_size = SIDE;
    a.h_width = 256, a.h_gru = 64, a.iterations = 6, a.recurrent = false, a.descent = NN_DESCENT_NONE,
    a.mean_before_norm = false;
    a.rmse = NN_RMSE_BATCH, a.encoding = NN_GRADIENT_RAW;
    measure(a, NN_COMPAT_PUBLISHED, "inference, 256 x 256, the published networks");
}
