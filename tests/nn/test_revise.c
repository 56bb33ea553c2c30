/* h that revises R_0 at g's full size. */
#include "nn/revise.h"
#include "nn/need.h"
#include "tests/support/networks.h"

enum { FINE = 4 * SIDE, VALUES = FINE * FINE * 9, MATERIALS = 3 };

static const unsigned char known[MATERIALS] = {NN_KNOWN_ALL, 0, NN_KNOWN_CAMERA};

/* Photographs of materials, and maps that are not theirs. */
typedef struct scene {
    nn_input in;
    float *maps, *spread;
    rd_view views[MATERIALS];
} scene;

static scene scene_make(void)
{
    scene s = {.in = photographs(MATERIALS, FINE, 31, NULL),
               .maps = numbers((size_t)MATERIALS * VALUES, 32, -0.9f, 0.9f),
               .spread = numbers((size_t)MATERIALS * FINE * FINE * NN_SPREADS, 33, -1, 1)};
    for (int i = 0; i < MATERIALS; i++) {
        s.views[i] = rd_flash();
        s.views[i].light[0] = 0.05f * (float)i;
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
    const ts_shape shape = {count, FINE, FINE, 9}, image = {count, FINE, FINE, 3},
                   spread = {count, FINE, FINE, NN_SPREADS};
    return (nn_revision){
        .image = ts_view(s->in.image.data + (int64_t)first * FINE * FINE * 3, image),
        .views = s->views + first,
        .known = known + first,
        .maps = ag_constant(tape, ts_view(s->maps + (int64_t)first * VALUES, shape)),
        .spread = ag_constant(tape, ts_view(s->spread + (int64_t)first * FINE * FINE * NN_SPREADS, spread))};
}

/* An h that learned nothing changes nothing; another changes maps and spread, the second time from its state. */
TEST(revise_begins_as_the_identity)
{
    nn_model *m = revising();
    scene s = scene_make();
    ag_tape *tape = tape_create(false);
    nn_revision r = begin(tape, &s, 0, MATERIALS);
    CHECK(nn_revise(tape, m, &r) && nn_revise(tape, m, &r), "%s", ag_status(tape)->message);
    float *kept = malloc(sizeof *kept * (size_t)MATERIALS * VALUES);
    memcpy(kept, r.maps->t.data, sizeof *kept * (size_t)MATERIALS * VALUES);
    nn_revision again = begin(tape, &s, 0, MATERIALS);
    CHECK(nn_revise(tape, m, &again), "%s", ag_status(tape)->message);
    again.state = NULL; /* forgotten */
    CHECK(nn_revise(tape, m, &again), "%s", ag_status(tape)->message);
    CHECK(memcmp(kept, again.maps->t.data, sizeof *kept * (size_t)MATERIALS * VALUES), "the state is not read");
    CHECK(memcmp(s.spread, again.spread->t.data, sizeof *kept * FINE * FINE * NN_SPREADS), "the spread stays");
    ag_reset(tape);
    const nn_param *last = nn_model_find(m, "h.full.conv2.weight");
    memset(m->value + last->offset, 0, last->count * sizeof(float));
    r = begin(tape, &s, 0, MATERIALS);
    CHECK(nn_revise(tape, m, &r), "%s", ag_status(tape)->message);
    for (int k = 0; k < MATERIALS * VALUES; k++)
        CHECK(fabsf(s.maps[k] - r.maps->t.data[k]) < 1e-6f, "without a change %g became %g", (double)s.maps[k],
              (double)r.maps->t.data[k]);
    ag_tape_destroy(&tape);
    free(kept);
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
            most = fmax(most, fabs((double)one.maps->t.data[k] - (double)all.maps->t.data[(int64_t)i * VALUES + k]));
        CHECK(most < 1e-5, "material %d differs by %g from itself in a batch", i, most);
    }
    ag_tape_destroy(&tape);
    ag_tape_destroy(&alone);
    scene_free(&s);
    nn_model_free(&m);
}

/* A part of a loss' slope along a random direction of h's parameters, against the difference quotient. What h reads is
 * a constant for back-propagation: of one revision the two agree. */
TEST(revise_has_a_gradient)
{
    nn_model *m = revising();
    scene s = scene_make();
    double slope = 0, value[2];
    size_t first, last;
    nn_model_range(m, NN_H, &first, &last);
    float *way = numbers(last - first, 34, -1, 1), *before = malloc((last - first) * sizeof *before);
    memcpy(before, m->value + first, (last - first) * sizeof *before);
    const float step = 1e-3f;
    for (int k = 0; k < 3; k++) {
        ag_tape *tape = tape_create(k == 2);
        ag_compute_set(tape, (ts_compute){.exact = true});
        for (size_t i = first; i < last && k < 2; i++)
            m->value[i] = before[i - first] + (k ? step : -step) * way[i - first];
        if (k == 2) memcpy(m->value + first, before, (last - first) * sizeof *before);
        nn_revision r = begin(tape, &s, 0, 1);
        CHECK(nn_revise(tape, m, &r), "%s", ag_status(tape)->message);
        ag_value *loss = ag_channel_mean(tape, ag_resize(tape, ag_concat(tape, r.maps, r.spread), 1, 1));
        loss = ag_linear(
            tape, loss,
            ag_constant(tape, ts_view((float[13]){1, -2, 3, 1, 2, -1, 1, 2, 3, 1, 1, -1, 2}, (ts_shape){1, 1, 1, 13})),
            NULL);
        CHECK(loss, "%s", ag_status(tape)->message);
        if (k < 2) value[k] = (double)loss->t.data[0];
        else {
            ag_backward(tape, loss);
            for (size_t i = first; i < last; i++) slope += (double)m->grad[i] * (double)way[i - first];
        }
        ag_tape_destroy(&tape);
    }
    const double quotient = (value[1] - value[0]) / (2 * (double)step);
    CHECK(fabs(slope) > 1e-3 && fabs(slope - quotient) < 0.02 * fabs(slope), "slope %g, quotient %g", slope, quotient);
    free(way), free(before);
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
        const double taken = (double)ts_arena_peak(ag_arena(tape)), counted = nn_revision_bytes(&a);
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
    nn_arch a = m->arch;
    ts_status st = {0};
    a.conditions = false;
    CHECK(nn_arch_check(&a, &st) == TS_INVALID && strstr(st.message, "revisions"), "%s", st.message);
    a = m->arch, a.g_size = 18, a.g_levels = 1;
    CHECK(nn_arch_check(&a, &st) == TS_INVALID && strstr(st.message, "revisions"), "%s", st.message);
    CHECK(nn_arch_steps(&m->arch, 1) == 6 && nn_arch_steps(&m->arch, 2) == 8, "%d and %d steps",
          nn_arch_steps(&m->arch, 1), nn_arch_steps(&m->arch, 2));
    ag_tape_destroy(&tape);
    scene_free(&s);
    nn_model_free(&m);
    nn_model_free(&without);
}
