/* The coarse steps of the loop. */
#include "render/losses.h"
#include "tests/support/networks.h"

/* A photograph that is no larger than coarse_size: the first steps are those of a loop of their own parameters, the
 * others go on from what these leave. */
TEST(nn_coarse_steps_of_a_small_photograph_are_a_loop_like_any)
{
    enum { COARSE = 2, ALL = 4 };
    nn_arch whole = tiny(), alone = tiny();
    whole.coarse_steps = COARSE, whole.coarse_size = 30, whole.coarse_width = whole.h_width = alone.h_width,
    whole.coarse_gru = alone.h_gru;
    nn_model *m = create(&whole, 7), *small = create(&alone, 7);
    enliven(m);
    for (int i = 0; i < small->params; i++) { /* h of the small one is the other's coarse network */
        char name[128];
        const bool h = strncmp(small->param[i].name, "h.", 2) == 0;
        snprintf(name, sizeof name, "%s%s", h ? "coarse." : "", small->param[i].name + (h ? 2 : 0));
        const nn_param *from = nn_model_find(m, name);
        CHECK(from && from->count == small->param[i].count, "%s", name);
        memcpy(small->value + small->param[i].offset, m->value + from->offset, from->count * sizeof(float));
    }
    nn_input in = photographs(2, 24, 4, NULL);
    ag_tape *a = tape_create(false), *b = tape_create(false);
    ag_value *x[ALL + 1], *y[COARSE + 1];
    CHECK(!nn_lgd(a, m, &in, ALL, true, x, NULL), "%s", ag_status(a)->message);
    CHECK(!nn_lgd(b, small, &in, COARSE, true, y, NULL), "%s", ag_status(b)->message);
    for (int t = 0; t <= COARSE; t++) CHECK(same(x[t], y[t]), "R_%d is another one than h's", t);
    nn_state state = {.step = COARSE};
    ag_value *next = x[COARSE];
    for (int t = COARSE + 1; t <= ALL; t++) {
        next = nn_refine(a, m, &in, next, &state);
        CHECK(next && same(next, x[t]), "R_%d does not go on from R_%d", t, COARSE);
    }
    ag_tape_destroy(&a);
    ag_tape_destroy(&b);
    nn_model_free(&m);
    nn_model_free(&small);
}

/* The photographs at most twice the coarse size. */
static ag_value *as_read(ag_tape *t, const nn_input *in, int side, int coarse)
{
    ag_value *image = ag_constant(t, in->image);
    return side > 2 * coarse ? ag_resize(t, image, 2 * coarse, 2 * coarse) : image;
}

/* What a larger photograph says is averaged: without its network a coarse step is half of the mean of Newton's. Of one
 * that is more than twice as large this is said of what is left at twice the size. 400 pixels are read in bands. */
TEST(nn_coarse_steps_read_the_photograph_at_up_to_twice_their_size)
{
    static const struct {
        int side, coarse;
    } sizes[] = {{30, SIDE}, {40, SIDE}, {300, SIDE}, {9, SIDE}, {600, 200}, {390, 200}};
    const float damping[9] = {NN_NEWTON_DAMPING,          NN_NEWTON_DAMPING,          NN_NEWTON_DAMPING,
                              NN_NEWTON_DAMPING,          NN_NEWTON_DAMPING,          NN_NEWTON_DAMPING,
                              NN_NEWTON_DAMPING_SPECULAR, NN_NEWTON_DAMPING_SPECULAR, NN_NEWTON_DAMPING_SPECULAR};
    for (size_t k = 0; k < sizeof sizes / sizeof *sizes; k++) {
        const int side = sizes[k].side;
        nn_arch a = tiny();
        a.coarse_steps = 1, a.h_width = 0, a.coarse_size = sizes[k].coarse;
        nn_model *m = create(&a, 7);
        const nn_param *p = nn_model_find(m, "coarse.output.weight");
        memset(m->value + p->offset, 0, p->count * sizeof *m->value);
        nn_input in = photographs(2, side, 4, NULL);
        ag_tape *t = tape_create(false);
        ag_value *maps[2];
        CHECK(!nn_coarse_steps(t, m, &in, 1, maps, NULL, NULL), "%s", ag_status(t)->message);
        const int coarse = side < sizes[k].coarse ? side : sizes[k].coarse;
        const ag_value *read = as_read(t, &in, side, coarse);
        const int size = read->t.shape.h;
        CHECK(size == (side < 2 * coarse ? side : 2 * coarse), "%d pixels are read", size);
        ag_value *from = ag_resize_smooth(t, maps[0], coarse, coarse), *full = ag_resize_smooth(t, from, size, size),
                 *newton = ag_empty(t, full->t.shape);
        const size_t pixels = (size_t)size * (size_t)size;
        for (size_t n = 0; n < 2; n++) {
            const float *image = read->t.data + n * pixels * 3;
            rd_newton_step(rd_grid_full(size), full->t.data + n * pixels * 9, 9, &in.view, &image, 1, damping,
                           newton->t.data + n * pixels * 9);
        }
        newton = ag_resize(t, newton, coarse, coarse);
        double worst = 0, most = 0;
        for (int64_t i = 0; i < ts_count(maps[1]->t.shape); i++) {
            const double change = maps[1]->t.data[i] - from->t.data[i];
            worst = farther(worst, fabs(change - 0.5 * newton->t.data[i]));
            most = farther(most, fabs(change));
        }
        CHECK(worst < 1e-6 && most > 1e-3, "%d pixels: the step is up to %g off, itself up to %g", side, worst, most);
        ag_tape_destroy(&t);
        nn_model_free(&m);
    }
}

/* A fixed part gets no gradient, the others do. */
TEST(nn_parts_can_be_fixed)
{
    enum { STEPS = 3 };
    nn_arch a = tiny();
    a.coarse_steps = 2, a.coarse_width = 6, a.coarse_gru = 3;
    nn_model *m = create(&a, 7);
    enliven(m);
    nn_input in = photographs(1, 24, 4, NULL);
    for (int part = NN_G; part <= NN_COARSE; part++) {
        ag_tape *t = tape_create(true);
        ag_value *maps[STEPS + 1];
        memset(m->grad, 0, m->count * sizeof *m->grad);
        for (int k = NN_G; k <= NN_COARSE; k++) m->fixed[k] = k == part;
        CHECK(!nn_lgd(t, m, &in, STEPS, true, maps, NULL), "%s", ag_status(t)->message);
        float *goal = numbers((size_t)ts_count(maps[STEPS]->t.shape), 5, -0.5f, 0.5f);
        CHECK(!ag_backward(t, ag_map_loss(t, maps[STEPS], ag_constant(t, ts_view(goal, maps[STEPS]->t.shape)), NULL)),
              "%s", ag_status(t)->message);
        for (int k = NN_G; k <= NN_COARSE; k++) {
            size_t first, last, nonzero = 0;
            nn_model_range(m, (nn_part)k, &first, &last);
            for (size_t i = first; i < last; i++) nonzero += m->grad[i] != 0;
            CHECK((nonzero > 0) == (k != part), "part %d fixed: part %d has %zu gradients", part, k, nonzero);
        }
        free(goal);
        ag_tape_destroy(&t);
    }
    nn_model_free(&m);
}
