/* h that revises the maps of several photographs at g's full size. */
#include "nn/deviation.h"
#include "nn/need.h"
#include "nn/revise.h"
#include "render/posterior.h"
#include "tests/support/networks.h"

enum { FINE = 4 * SIDE, PIXELS = FINE * FINE, VALUES = PIXELS * 9, MATERIALS = 3, GIVEN = 3 };

/* Photographs of materials, and maps that are not theirs. */
typedef struct scene {
    nn_input in;
    float *maps, *spread;
    rd_view views[MATERIALS * GIVEN];
    unsigned char known[MATERIALS * GIVEN];
} scene;

static scene scene_make(void)
{
    scene s = {.in = photographs(MATERIALS * GIVEN, FINE, 31, NULL),
               .maps = numbers((size_t)MATERIALS * VALUES, 32, -0.9f, 0.9f),
               .spread = numbers((size_t)MATERIALS * PIXELS * NN_SPREADS, 33, -1, 1)};
    for (int i = 0; i < MATERIALS * GIVEN; i++) {
        s.views[i] = rd_capture_view(i % GIVEN);
        s.known[i] = NN_KNOWN_ALL;
    }
    return s;
}

static void scene_free(scene *s)
{
    free(s->in.image.data);
    free(s->maps);
    free(s->spread);
}

/* Of count materials from number first on. */
static nn_revision begin(ag_tape *tape, const scene *s, int first, int count)
{
    const ts_shape shape = {count, FINE, FINE, 9}, image = {count * GIVEN, FINE, FINE, 3},
                   spread = {count, FINE, FINE, NN_SPREADS};
    return (nn_revision){
        .given = GIVEN,
        .image = ts_view(s->in.image.data + (int64_t)first * GIVEN * PIXELS * 3, image),
        .views = s->views + first * GIVEN,
        .known = s->known + first * GIVEN,
        .maps = ag_constant(tape, ts_view(s->maps + (int64_t)first * VALUES, shape)),
        .spread = ag_constant(tape, ts_view(s->spread + (int64_t)first * PIXELS * NN_SPREADS, spread))};
}

/* maps become what all steps make of them. */
static void descend(const nn_model *m, const scene *s, int material, float *maps)
{
    const rd_grid grid = rd_grid_full(FINE);
    const int first = material * GIVEN;
    float *mean = malloc(VALUES * sizeof *mean), *step = malloc(VALUES * sizeof *step),
          *best = malloc(VALUES * sizeof *best), *misfit = malloc(PIXELS * sizeof *misfit),
          *deviation = malloc(PIXELS * NN_SPREADS * sizeof *deviation);
    const float *image[GIVEN];
    for (int k = 0; k < GIVEN; k++) image[k] = s->in.image.data + (int64_t)(first + k) * PIXELS * 3;
    memcpy(mean, maps, VALUES * sizeof *mean);
    nn_deviations(PIXELS, s->spread + (int64_t)material * PIXELS * NN_SPREADS, (nn_belief){.photographs = GIVEN}, 1,
                  deviation);
    const rd_prior prior = {mean, deviation, nn_step_prior(s->known[first], GIVEN)};
    for (int t = 0; t < nn_arch_steps(&m->arch, GIVEN); t++) {
        const rd_search search = {best, misfit, t > 0};
        rd_posterior_step(grid, maps, 9, s->views + first, image, GIVEN, &prior, rd_step_length(GIVEN, t), &search,
                          step, NULL);
        for (int i = 0; i < VALUES; i++) maps[i] += step[i];
    }
    free(mean), free(step), free(best), free(misfit), free(deviation);
}

/* An h that learned nothing leaves what the steps make; another changes maps and spread. */
TEST(revise_begins_with_the_steps)
{
    nn_model *m = revising();
    scene s = scene_make();
    ag_tape *tape = tape_create(false);
    nn_revision r = begin(tape, &s, 0, MATERIALS);
    CHECK(nn_revise(tape, m, &r) && r.made == 1, "%s", ag_status(tape)->message);
    float *changed = malloc(sizeof *changed * (size_t)MATERIALS * VALUES);
    memcpy(changed, r.maps->t.data, sizeof *changed * (size_t)MATERIALS * VALUES);
    CHECK(memcmp(s.spread, r.spread->t.data, sizeof *changed * PIXELS * NN_SPREADS), "the spread stays");
    ag_reset(tape);
    const nn_param *last = nn_model_find(m, "h.full.conv3.weight");
    memset(m->value + last->offset, 0, last->count * sizeof(float));
    r = begin(tape, &s, 0, MATERIALS);
    CHECK(nn_revise(tape, m, &r), "%s", ag_status(tape)->message);
    CHECK(!memcmp(s.spread, r.spread->t.data, sizeof *changed * PIXELS * NN_SPREADS), "without a change it moves");
    for (int n = 0; n < MATERIALS; n++) {
        float *maps = s.maps + n * VALUES;
        descend(m, &s, n, maps);
        double change = 0;
        for (int k = 0; k < VALUES; k++) {
            const float own = r.maps->t.data[n * VALUES + k];
            CHECK(fabsf(maps[k] - own) < 1e-5f, "the steps make %g, and without a change it is %g", (double)maps[k],
                  (double)own);
            change = farther(change, fabs((double)changed[n * VALUES + k] - (double)own));
        }
        CHECK(change > 1e-3, "h changes by %g at most", change);
    }
    ag_tape_destroy(&tape);
    free(changed);
    scene_free(&s);
    nn_model_free(&m);
}

/* What h makes of a material does not depend on its neighbours in the batch, nor on the number of threads. */
TEST(revise_materials_apart)
{
    nn_model *m = revising();
    scene s = scene_make();
    ag_tape *tape = tape_create(false), *alone = tape_create(false);
    nn_revision all = begin(tape, &s, 0, MATERIALS);
    CHECK(nn_revise(tape, m, &all) && nn_revise(tape, m, &all), "%s", ag_status(tape)->message);
    for (int i = 0; i < MATERIALS; i++) {
        ag_reset(alone);
        ag_compute_set(alone, (ts_compute){.exact = true, .threads = 1 + i});
        nn_revision one = begin(alone, &s, i, 1);
        CHECK(nn_revise(alone, m, &one) && nn_revise(alone, m, &one), "%s", ag_status(alone)->message);
        double most = 0;
        for (int k = 0; k < VALUES; k++)
            most = farther(most, fabs((double)one.maps->t.data[k] - (double)all.maps->t.data[(int64_t)i * VALUES + k]));
        CHECK(most < 1e-5, "material %d differs by %g from itself in a batch", i, most);
    }
    ag_tape_destroy(&tape);
    ag_tape_destroy(&alone);
    scene_free(&s);
    nn_model_free(&m);
}

/* A loss after one revision; gradients: h's get its slope. */
static double loss_of(const nn_model *m, const scene *s, bool gradients)
{
    static float weight[13] = {1, -2, 3, 1, 2, -1, 1, 2, 3, 1, 1, -1, 2};
    ag_tape *tape = tape_create(gradients);
    ag_compute_set(tape, (ts_compute){.exact = true});
    nn_revision r = begin(tape, s, 0, 1);
    CHECK(nn_revise(tape, m, &r), "%s", ag_status(tape)->message);
    ag_value *loss = ag_channel_mean(tape, ag_resize(tape, ag_concat(tape, r.maps, r.spread), 1, 1));
    loss = ag_linear(tape, loss, ag_constant(tape, ts_view(weight, (ts_shape){1, 1, 1, 13})), NULL);
    CHECK(loss, "%s", ag_status(tape)->message);
    if (gradients) ag_backward(tape, loss);
    const double value = (double)loss->t.data[0];
    ag_tape_destroy(&tape);
    return value;
}

/* A loss' slope along a random direction of each of h's layers, against the difference quotient. What h reads is a
 * constant for back-propagation: of one revision the two agree. */
/* What the sample is known to be h leaves alone: a metal's diffuse, a dielectric's F0. */
TEST(revise_keeps_what_a_kind_says)
{
    nn_model *m = revising();
    scene s = scene_make();
    for (int kind = NN_KIND_DIELECTRIC; kind <= NN_KIND_METAL; kind++) {
        ag_tape *tape = tape_create(false);
        nn_revision r = begin(tape, &s, 0, MATERIALS), free_one = r;
        r.kind = (nn_kind)kind;
        const float *before = r.maps->t.data;
        CHECK(nn_revise(tape, m, &r) && nn_revise(tape, m, &free_one), "%s", ag_status(tape)->message);
        const int held = kind == NN_KIND_METAL ? MAP_DIFFUSE : MAP_SPECULAR;
        bool moves = false;
        for (int i = 0; i < MATERIALS * VALUES; i++) {
            const bool here = i % 9 >= held && i % 9 < held + 3;
            CHECK(!here || r.maps->t.data[i] == before[i], "kind %d: value %d moves", kind, i);
            moves = moves || (here && free_one.maps->t.data[i] != before[i]);
        }
        CHECK(moves, "kind %d: nothing would move: the test is none", kind);
        ag_tape_destroy(&tape);
    }
    scene_free(&s);
    nn_model_free(&m);
}

TEST(revise_has_a_gradient)
{
    static const char *const layers[] = {"read.conv1", "read.conv2", "down1.conv1", "down2.conv2",
                                         "global",     "up2.conv1",  "up1.conv2",   "squares",
                                         "full.conv1", "full.conv2", "full.conv3"};
    nn_model *m = revising();
    scene s = scene_make();
    const float step = 1e-3f;
    loss_of(m, &s, true);
    for (size_t l = 0; l < sizeof layers / sizeof *layers; l++) {
        char name[64];
        snprintf(name, sizeof name, "h.%s.weight", layers[l]);
        const nn_param *p = nn_model_find(m, name);
        float *at = m->value + p->offset, *way = numbers(p->count, 34 + l, -1, 1),
              *before = malloc(p->count * sizeof *before);
        double slope = 0, value[2];
        memcpy(before, at, p->count * sizeof *before);
        for (int k = 0; k < 2; k++) {
            for (size_t i = 0; i < p->count; i++) at[i] = before[i] + (k ? step : -step) * way[i];
            value[k] = loss_of(m, &s, false);
        }
        memcpy(at, before, p->count * sizeof *before);
        for (size_t i = 0; i < p->count; i++) slope += (double)m->grad[p->offset + i] * (double)way[i];
        const double quotient = (value[1] - value[0]) / (2 * (double)step);
        CHECK(fabs(slope) > 1e-3 && fabs(slope - quotient) < 0.02 * fabs(slope) + 5e-4, "%s: slope %g, quotient %g",
              name, slope, quotient);
        free(way), free(before);
    }
    scene_free(&s);
    nn_model_free(&m);
}

TEST(need_of_a_revision_is_counted)
{
    scene s = scene_make();
    for (int width = 4; width <= 64; width *= 4) {
        nn_model *m = revising();
        nn_arch a = m->arch;
        nn_model_free(&m);
        a.revise_width = width;
        m = create(&a, 35);
        ag_tape *tape = tape_create(false);
        nn_revision r = begin(tape, &s, 0, 1);
        CHECK(nn_revise(tape, m, &r), "%s", ag_status(tape)->message);
        const double taken = (double)ts_arena_peak(ag_arena(tape)), counted = nn_revision_bytes(&a, GIVEN);
        CHECK(taken <= counted && counted < 2 * taken, "width %d: %.0f bytes are counted and %.0f taken", width,
              counted, taken);
        ag_tape_destroy(&tape);
        nn_model_free(&m);
    }
    scene_free(&s);
}

/* Another size and an architecture that h does not fit are errors of one line. */
TEST(revise_refuses)
{
    nn_model *m = revising(), *without = guessing();
    scene s = scene_make();
    ag_tape *tape = tape_create(false);
    nn_revision r = begin(tape, &s, 0, 1);
    CHECK(!nn_revise(tape, without, &r) && ag_status(tape)->code == TS_INVALID, "a model without h revises");
    ag_reset(tape);
    r = begin(tape, &s, 0, 1);
    r.image.shape.h = r.image.shape.w = FINE / 2;
    CHECK(!nn_revise(tape, m, &r) && ag_status(tape)->code == TS_INVALID, "a photograph of half the size is revised");
    ag_reset(tape);
    r = begin(tape, &s, 0, 1);
    r.given = 1;
    CHECK(!nn_revise(tape, m, &r) && ag_status(tape)->code == TS_INVALID, "one photograph is revised");
    nn_arch a = m->arch;
    ts_status st = {0};
    a.descent = NN_DESCENT_NEWTON;
    CHECK(nn_arch_check(&a, &st) == TS_INVALID && strstr(st.message, "revisions"), "%s", st.message);
    a = m->arch, a.iterations = 0;
    CHECK(nn_arch_check(&a, &st) == TS_INVALID && strstr(st.message, "revisions"), "%s", st.message);
    a = m->arch, a.g_size = 18, a.g_levels = 1;
    CHECK(nn_arch_check(&a, &st) == TS_INVALID && strstr(st.message, "revisions"), "%s", st.message);
    for (int photographs = 1; photographs <= 2; photographs++)
        for (int known = 0; known <= NN_KNOWN_ALL; known++) {
            const int made = nn_arch_revisions(&m->arch, photographs, known, 8);
            CHECK(made == (photographs == 2 && known == NN_KNOWN_ALL ? 2 : 0), "%d revisions of %d photographs", made,
                  photographs);
        }
    ag_tape_destroy(&tape);
    scene_free(&s);
    nn_model_free(&m);
    nn_model_free(&without);
}
