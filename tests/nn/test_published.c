/* The published network as a configuration: its tensors, its files without metadata of ours, its flash renderer. */
#include "infer/lgd.h"
#include "nn/weights/published.h"
#include "nn/weights/weights.h"
#include "render/brdf.h"
#include "render/published.h"
#include "render/render.h"
#include "render/rows.h"
#include "tensor/cpu.h"
#include "tests/support/trained.h"
#include "tests/test.h"
#include "train/config.h"
#include <math.h>
#include <stdlib.h>
#include <string.h>

static nn_arch paper(void)
{
    ts_status st = {0};
    tr_config c = tr_config_default();
    CHECK(!tr_config_read(&c, "configs/paper.ini", &st) && !tr_config_check(&c, &st), "%s", st.message);
    return c.arch;
}

TEST(published_tensors_are_the_configurations)
{
    char path[1024], line[256], name[160], shape[64];
    snprintf(path, sizeof path, "%s/paper_tensors.tsv", test_fixtures());
    FILE *f = fopen(path, "r");
    if (!f) test_skip("%s is absent", path);
    const nn_arch a = paper();
    ts_status st = {0};
    nn_model *m = nn_model_plan(&a, &st);
    CHECK(m, "%s", st.message);
    int i = 0;
    for (; fgets(line, sizeof line, f); i++) {
        char has[64] = "";
        CHECK(sscanf(line, "%159s %63s", name, shape) == 2, "line %s", line);
        CHECK(i < m->params, "%s: the model has no more tensors", name);
        const nn_param *p = &m->param[i];
        for (int k = 0; k < p->rank; k++)
            snprintf(has + strlen(has), sizeof has - strlen(has), "%s%d", k ? "x" : "", p->dim[k]);
        CHECK(!strcmp(p->name, name) && !strcmp(has, shape), "tensor %d is %s, %s, not %s, %s", i, p->name, has, name,
              shape);
    }
    fclose(f);
    CHECK(i == m->params, "the model has %d tensors, the list %d", m->params, i);
    nn_model_free(&m);
}

TEST(published_parameters_are_counted)
{
    const nn_arch a = paper();
    ts_status st = {0};
    nn_model *m = nn_model_plan(&a, &st);
    CHECK(m, "%s", st.message);
    CHECK(trained_numbers(m, NN_G) == 159741922 && trained_numbers(m, NN_H) == 405376, "g has %zu parameters, h %zu",
          trained_numbers(m, NN_G), trained_numbers(m, NN_H));
    nn_model_free(&m);
}

static nn_arch small(void)
{
    nn_arch a = paper();
    a.g_width = 3, a.g_width_max = 8, a.g_levels = 2, a.h_width = 6, a.h_gru = 2;
    return a;
}

/* The tensors of m but for number `without`, with number `shorter` in another shape, without any metadata. */
static const char *bare_file(const nn_model *m, int without, int shorter, const char *more)
{
    static char path[512];
    ts_status st = {0};
    nn_block *block = calloc((size_t)m->params + 1, sizeof *block);
    int count = 0;
    for (int i = 0; i < m->params; i++) {
        const nn_param *p = &m->param[i];
        if (i == without) continue;
        block[count] = (nn_block){.name = p->name, .rank = p->rank, .data = m->value + p->offset};
        for (int k = 0; k < p->rank; k++) block[count].dim[k] = p->dim[k];
        if (i == shorter) block[count].dim[0]--;
        count++;
    }
    if (more) block[count++] = (nn_block){.name = more, .rank = 1, .dim = {1}, .data = m->value};
    snprintf(path, sizeof path, "%s/bare.safetensors", test_folder());
    CHECK(!nn_safetensors_write(path, block, count, NULL, 0, &st), "%s", st.message);
    free(block);
    return path;
}

TEST(published_files_are_recognised)
{
    ts_status st = {0};
    const nn_arch a = small();
    nn_model *m = nn_model_create(&a, &st);
    CHECK(m, "%s", st.message);
    nn_model_init(m, 7);
    nn_model *back = nn_model_load(bare_file(m, -1, -1, "epoch"), &st);
    CHECK(back, "%s", st.message);
    CHECK(!memcmp(&back->arch, &a, sizeof a), "another architecture is recognised");
    CHECK(!memcmp(back->value, m->value, m->count * sizeof *m->value), "other values are read");
    nn_model_free(&back);
    char path[512];
    snprintf(path, sizeof path, "%s/own.safetensors", test_folder());
    CHECK(!nn_model_save(m, m->value, path, NULL, 0, &st) && (back = nn_model_load(path, &st)), "%s", st.message);
    CHECK(back->arch.compat == NN_COMPAT_PUBLISHED, "the metadata does not say compat");
    nn_model_free(&back);
    const int gone = 9, wrong = (int)(nn_model_find(m, "main_net.rnn.layers.1.rnn_cell.ih.weight") - m->param);
    CHECK(!nn_model_load(bare_file(m, gone, -1, NULL), &st) && strstr(st.message, m->param[gone].name),
          "a missing tensor gives '%s'", st.message);
    st = (ts_status){0};
    CHECK(!nn_model_load(bare_file(m, -1, wrong, NULL), &st) && strstr(st.message, m->param[wrong].name),
          "a wrong shape gives '%s'", st.message);
    st = (ts_status){0};
    CHECK(!nn_model_load(bare_file(m, -1, -1, "main_net.attention"), &st) && strstr(st.message, "main_net.attention"),
          "one too many gives '%s'", st.message);
    st = (ts_status){0};
    CHECK(!nn_model_load(bare_file(m, 0, -1, NULL), &st) && strstr(st.message, "published"), "other tensors give '%s'",
          st.message);
    nn_model_free(&m);
}

TEST(published_needs_its_other_keys)
{
    ts_status st = {0};
    nn_arch a = small();
    a.descent = NN_DESCENT_NEWTON;
    CHECK(nn_arch_check(&a, &st) == TS_INVALID && strstr(st.message, "descent"), "'%s'", st.message);
}

/* The published renderer (render/published.h), written out directly: value of colour c. */
static double plain(const double m[9], const double at[2], int c)
{
    const double e = 1e-6, d = 250.0 / 256, power = 329288.0 / 65536, pi = acos(-1);
    double x[9];
    for (int i = 0; i < 9; i++) x[i] = fmin(fmax(m[i], -1), 1);
    const double diffuse = (x[c] + 1) / 2, specular = (x[6 + c] + 1) / 2, rough = fmax((x[5] + 1) / 2, e);
    double nz = sqrt(1 - fmin(x[3] * x[3] + x[4] * x[4], 1 - e)), length = sqrt(x[3] * x[3] + x[4] * x[4] + nz * nz);
    double r2 = at[0] * at[0] + at[1] * at[1] + d * d, r = sqrt(r2);
    double cosine = fmax((-x[3] * at[0] - x[4] * at[1] + nz * d) / r / length, 0);
    double alpha = rough * rough, below = cosine * cosine * (alpha * alpha - 1) + 1, k = alpha / 2 + e,
           g = cosine / (cosine * (1 - k) + k);
    double fresnel = specular + (1 - specular) * pow(2, -5.55473 - 6.98316),
           ggx = alpha * alpha / (pi * below * below + e);
    return ((1 - specular) * diffuse / pi + ggx * g * g * fresnel / (4 * cosine * cosine + e)) * cosine * power / r2;
}

static void random_maps(ts_rng *rng, double m[9])
{
    for (int i = 0; i < 9; i++) m[i] = 1.05 * (2 * ts_rng_uniform(rng) - 1);
    if (ts_rng_int(rng, 3) == 0) m[3] *= 0.1, m[4] *= 0.1; /* where the highlight is */
    if (ts_rng_int(rng, 4) == 0) m[5] = -1.02 + 0.05 * ts_rng_uniform(rng);
}

/* The usual (n.h)^2 (alpha^2 - 1) + 1 cancels near the highlight of a smooth surface, which the oracle's form does not:
 * compared where it is sound. */
static bool sound(const double m[9]) { return fmin(fmax(m[5], -1), 1) > -0.9; }

TEST(published_renderer_is_the_stated_one)
{
    ts_rng rng = ts_rng_make(3, TS_STREAM_TEST, 0);
    const rd_view view = rd_published_flash();
    double worst = 0, worst_gradient = 0;
    for (int t = 0; t < 20000; t++) {
        double m[9], at[2] = {ts_rng_uniform(&rng) - 0.5, ts_rng_uniform(&rng) - 0.5}, value[3], by[3][9];
        random_maps(&rng, m);
        rd_radiance(m, at, &view, value, by);
        const int c = t % 3;
        if (!sound(m)) continue;
        const double expected = plain(m, at, c);
        worst = farther(worst, fabs(value[c] - expected) / (expected + 1e-6));
        for (int i = 0; i < 9; i++) {
            const double step = 1e-6, edge = fabs(m[3]) < 1 && fabs(m[4]) < 1 ? m[3] * m[3] + m[4] * m[4] - 1 : 0;
            if (fabs(fabs(m[i]) - 1) < 2 * step || fabs(edge) < 1e-3)
                continue; /* a kink, or a slope that differences cannot follow */
            double low[9], high[9];
            memcpy(low, m, sizeof low), memcpy(high, m, sizeof high);
            low[i] -= step, high[i] += step;
            const double slope = (plain(high, at, c) - plain(low, at, c)) / (2 * step),
                         scale = fabs(slope) + 10 * expected + 1e-3;
            if (expected == 0 || plain(low, at, c) == 0 || plain(high, at, c) == 0) continue;
            worst_gradient = farther(worst_gradient, fabs(by[c][i] - slope) / scale);
        }
    }
    printf("  value %.2g, gradient %.2g\n", worst, worst_gradient);
    CHECK(worst < 1e-9, "the value is off by %g", worst);
    CHECK(worst_gradient < 1e-5, "the gradient is off by %g", worst_gradient);
}

/* The guards must be seen where they matter: a mirror's peak is alpha^2 / 1e-6, and at roughness 1e-6 there is no
 * highlight at all. */
TEST(published_guards_show)
{
    const rd_view view = rd_published_flash();
    const double at[2] = {0, 0};
    double value[3];
    for (int i = 0; i < 3; i++) {
        const double rough = (double[]){1e-6, 0.01, 0.03}[i], m[9] = {-1, -1, -1, 0, 0, 2 * rough - 1, 1, 1, 1};
        const double alpha = rough * rough, a4 = pow(alpha, 4), k = alpha / 2 + 1e-6, g = 1 / (1 - k + k);
        const double expected = alpha * alpha / (acos(-1) * a4 + 1e-6) * g * g / (4 + 1e-6) * rd_published.power /
            (rd_published.distance * rd_published.distance);
        rd_radiance(m, at, &view, value, NULL);
        CHECK(fabs(value[0] - expected) <= 1e-6 * expected, "roughness %g: %g, not %g", rough, value[0], expected);
    }
}

TEST(published_kernels_match_the_reference)
{
    enum { SIDE = 31, C = 10, ROUNDS = 8 };
    const rd_view view = rd_published_flash();
    const rd_grid grid = rd_grid_full(SIDE);
    float *maps = calloc(SIDE * SIDE * C, sizeof *maps), *image = calloc(SIDE * SIDE * 3, sizeof *image),
          *target = calloc(SIDE * SIDE * 3, sizeof *target);
    float *gradient = calloc(SIDE * SIDE * C, sizeof *gradient);
    for (int isa = TS_BASE; isa <= (int)ts_isa_best(); isa++) {
        ts_isa_use((ts_isa)isa);
        ts_rng rng = ts_rng_make(4, TS_STREAM_TEST, 0);
        double worst = 0, worst_gradient = 0;
        for (int round = 0; round < ROUNDS; round++) {
            for (int p = 0; p < SIDE * SIDE; p++) {
                double m[9];
                random_maps(&rng, m);
                for (int i = 0; i < 9; i++) maps[p * C + i] = (float)m[i];
                for (int c = 0; c < 3; c++) target[p * 3 + c] = ts_rng_range(&rng, 0, 1);
            }
            rd_render(grid, maps, C, &view, true, image);
            rd_flash_gradient(grid, maps, C, &view, target, 1, gradient, NULL);
            for (int p = 0; p < SIDE * SIDE; p++) {
                double m[9], at[2], value[3], by[3][9], sum[9] = {0}, scale = 1e-3;
                for (int i = 0; i < 9; i++) m[i] = (double)maps[p * C + i];
                rd_centre(grid, p % SIDE, p / SIDE, at);
                rd_radiance(m, at, &view, value, by);
                if (fmin(fabs(value[0] - 1), fmin(fabs(value[1] - 1), fabs(value[2] - 1))) < 1e-4)
                    continue; /* clamped in one of the two, perhaps */
                const double xy = m[3] * m[3] + m[4] * m[4];
                if (xy > 1 - 1e-3 && xy < 1 + 1e-3) continue; /* n_z's slope grows without bound */
                for (int c = 0; c < 3; c++) {
                    const double shown = fmin(value[c], 1), unit = rd_published.gradient / (3.0 * 256 * 256);
                    worst = farther(worst, fabs((double)image[p * 3 + c] - shown) / (shown + 1e-3));
                    for (int i = 0; i < 9 && value[c] <= 1; i++) {
                        sum[i] += unit * (shown - (double)target[p * 3 + c]) * by[c][i];
                        scale = fmax(scale, unit * fabs(by[c][i]));
                    }
                }
                for (int i = 0; i < 9; i++)
                    worst_gradient = farther(worst_gradient, fabs((double)gradient[p * C + i] - sum[i]) / scale);
                CHECK(gradient[p * C + 9] == 0, "the tenth channel has a gradient");
            }
        }
        printf("  %s: value %.2g, gradient %.2g\n", ts_isa_name((ts_isa)isa), worst, worst_gradient);
        CHECK(worst < 2e-5 && worst_gradient < 2e-4, "%s: value off by %g, gradient by %g", ts_isa_name((ts_isa)isa),
              worst, worst_gradient);
    }
}

/* A small network of this kind: every instruction set gives what the base one gives, to rounding, which a random h
 * magnifies some fourfold at each step. The parity at the paper's size runs on the best one alone (test_parity.c). */
TEST(published_network_on_every_instruction_set)
{
    enum { SIDE = 32, C = 10, VALUES = SIDE * SIDE * C, STEPS = 2 };
    ts_status st = {0};
    nn_arch a = small();
    a.g_width = 8, a.g_width_max = 32, a.g_levels = 3, a.g_size = SIDE, a.h_width = 24, a.h_gru = 12;
    nn_model *m = nn_model_create(&a, &st);
    CHECK(m, "%s", st.message);
    nn_model_init(m, 11);
    const nn_param *last = nn_model_find(m, "main_net.rnn.layers.2.input_fun.conv_layer.weight");
    for (size_t i = 0; i < last->count; i++) m->value[last->offset + i] *= 10; /* h begins as nothing, nearly */
    float *image = malloc(SIDE * SIDE * 3 * sizeof *image), *base = malloc((STEPS + 1) * VALUES * sizeof *base);
    ts_rng rng = ts_rng_make(12, TS_STREAM_TEST, 0);
    for (int i = 0; i < SIDE * SIDE * 3; i++) image[i] = ts_rng_range(&rng, 0.1f, 0.7f);
    const nn_input in = {
        .image = ts_view(image, (ts_shape){1, SIDE, SIDE, 3}), .grid = rd_grid_full(SIDE), .view = rd_flash()};
    for (int isa = TS_BASE; isa <= (int)ts_isa_best(); isa++) {
        ts_isa_use((ts_isa)isa);
        ag_tape *t = ag_tape_create(false, &st);
        ag_value *maps[STEPS + 1];
        CHECK(t && !nn_lgd(t, m, &in, STEPS, true, maps, NULL), "%s", t ? ag_status(t)->message : st.message);
        for (int k = 0; k <= STEPS; k++) {
            double sum = 0;
            for (int i = 0; i < VALUES; i++) {
                if (isa == TS_BASE) base[k * VALUES + i] = maps[k]->t.data[i];
                sum += fabs((double)maps[k]->t.data[i] - (double)base[k * VALUES + i]) / VALUES;
            }
            printf("  %s: R_%d differs by %.2g\n", ts_isa_name((ts_isa)isa), k, sum);
            CHECK(sum < 1e-6 * pow(5, k), "%s: R_%d differs by %g on average", ts_isa_name((ts_isa)isa), k, sum);
        }
        CHECK(isa > TS_BASE || fabs((double)base[STEPS * VALUES] - (double)base[0]) > 1e-4, "h changes nothing");
        ag_tape_destroy(&t);
    }
}

/* Whether --exact changes what a small g makes of a photograph. */
static bool heeds_exact(bool published, int levels, int width)
{
    enum { SIDE = 128 };
    ts_status st = {0};
    lgd_error error;
    char path[512];
    static float image[SIDE * SIDE * 3], maps[2][SIDE * SIDE * 9];
    ts_rng rng = ts_rng_make(13, TS_STREAM_TEST, 0);
    for (int i = 0; i < SIDE * SIDE * 3; i++) image[i] = ts_rng_range(&rng, 0.1f, 0.7f);
    nn_arch a = small();
    a.g_width = width, a.g_width_max = 32, a.g_levels = levels, a.g_kernel = 3, a.g_size = SIDE, a.h_width = 0,
    a.iterations = 0;
    if (!published) a.compat = NN_COMPAT_NONE;
    nn_model *m = nn_model_create(&a, &st);
    CHECK(m, "%s", st.message);
    nn_model_init(m, 11);
    snprintf(path, sizeof path, "%s/%d.%d.safetensors", test_folder(), published, levels);
    CHECK(!nn_model_save(m, m->value, path, NULL, 0, &st), "%s", st.message);
    nn_model_free(&m);
    lgd_model *model = lgd_load(path, &error);
    CHECK(model, "%s", error.message);
    for (int exact = 0; exact < 2; exact++) {
        lgd_options o = lgd_options_default();
        o.exact = exact;
        CHECK(!lgd_estimate(model, image, SIDE, &o, maps[exact], &error), "%s", error.message);
    }
    lgd_free(&model);
    return memcmp(maps[0], maps[1], sizeof maps[0]) != 0;
}

/* With 8 channels the last block and what follows have too few for Winograd's algorithm, the layers before have not. */
TEST(published_g_is_run_directly_before_its_last_block)
{
    CHECK(heeds_exact(false, 3, 8), "Winograd's algorithm is not for these layers");
    CHECK(!heeds_exact(true, 3, 8), "a layer before the last block is not computed directly");
    CHECK(heeds_exact(true, 1, 32), "the last block is computed directly");
}
