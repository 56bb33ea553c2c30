/* The auto-encoder, and what must not move while others learn. */
#include "nn/weights/weights.h"
#include "render/losses.h"
#include "tests/support/networks.h"
#include "tests/support/runs.h"

static nn_model *coder(void)
{
    ts_status st = {0};
    nn_model *m = nn_coder_create(&(nn_coder){.code = 3, .width = 4, .width_max = 8, .levels = 2}, &st);
    CHECK(m, "%s", st.message);
    nn_model_init(m, 3);
    return m;
}

TEST(coder_code_has_its_shape_and_other_models_have_none)
{
    const nn_arch a = tiny();
    nn_model *m = coder(), *g = create(&a, 3);
    ag_tape *t = tape_create(false);
    float *maps = numbers(2 * 24 * 24 * 9, 5, -1, 1);
    ag_value *x = ag_constant(t, ts_view(maps, (ts_shape){2, 24, 24, 9})), *code = nn_encode(t, m, x),
             *back = nn_decode(t, m, code);
    check_tape(t);
    CHECK(ts_same(code->t.shape, (ts_shape){2, 6, 6, 3}) && ts_same(back->t.shape, x->t.shape), "code %d x %d x %d",
          code->t.shape.h, code->t.shape.w, code->t.shape.c);
    for (int64_t i = 0; i < ts_count(back->t.shape); i++)
        CHECK(fabsf(back->t.data[i]) <= 1, "value %g", (double)back->t.data[i]);
    CHECK(!nn_encode(t, g, x) && strstr(ag_status(t)->message, "auto-encoder"), "g encodes: %s", ag_status(t)->message);
    ag_reset(t);
    nn_input in = photographs(1, 24, 4, NULL);
    CHECK(!nn_predict(t, m, &in) && strstr(ag_status(t)->message, "auto-encoder"),
          "an auto-encoder reads a photograph");
    ag_reset(t);
    x = ag_constant(t, ts_view(maps, (ts_shape){1, 24, 22, 9}));
    CHECK(!nn_encode(t, m, x) && strstr(ag_status(t)->message, "multiples of 4"), "%s", ag_status(t)->message);
    char path[300];
    ts_status st = {0};
    snprintf(path, sizeof path, "%s/latent.safetensors", test_folder());
    CHECK(nn_model_save(m, m->value, path, NULL, 0, &st) == TS_OK, "%s", st.message);
    CHECK(!nn_model_load(path, &st) && strstr(st.message, "is an auto-encoder"), "%s", st.message);
    nn_model *again = nn_coder_load(path, &st);
    CHECK(again && again->coder.code == 3 && !memcmp(again->value, m->value, m->count * sizeof(float)), "%s",
          st.message);
}

TEST(coder_learns_to_give_maps_back)
{
    tr_config c = small();
    ts_status st = {0};
    static const char *const keys[] = {
        "coder.code=4",   "model.h_width=0",   "model.iterations=0",   "train.pretrain_steps=0", "train.window=0",
        "train.steps=60", "coder.width=4",     "coder.width_max=8",    "coder.levels=2",         "train.rate=0.01",
        "train.ema=0",    "validate.every=30", "data.families=classic"};
    CHECK(tr_config_check(&c, &st) == TS_OK, "%s", st.message);
    for (size_t i = 0; i < sizeof keys / sizeof *keys; i++) {
        if (i == 3)
            CHECK(tr_config_check(&c, &st) == TS_INVALID && strstr(st.message, "pretrain_steps"), "%s", st.message);
        st = (ts_status){0};
        CHECK(tr_config_set_assignment(&c, keys[i], &st) == TS_OK, "%s", st.message);
    }
    tr_trainer *t = tr_create(&c, folder("latent"), false, NULL, NULL, &st);
    CHECK(t, "%s", st.message);
    double loss[60];
    for (int i = 0; i < 60; i++) {
        tr_row row;
        CHECK(tr_step(t, &row, &st) == TS_OK && !row.skip, "%s", st.message);
        loss[i] = row.loss;
    }
    double first = 0, last = 0;
    for (int i = 0; i < 10; i++) first += loss[i] / 10, last += loss[50 + i] / 10;
    CHECK(last < 0.8 * first, "the loss goes from %g to %g", first, last);
    tr_validation v;
    CHECK(tr_validate(t, &v, &st) == TS_OK && v.iterations == 0 && v.render[0] > 0 && v.render[0] < 0.5, "%s",
          st.message);
    tr_destroy(&t);
}

TEST(trainer_with_g_rate_0_leaves_g_alone)
{
    tr_config c = small();
    ts_status st = {0};
    CHECK(tr_config_set_assignment(&c, "train.g_rate=0", &st) == TS_OK, "%s", st.message);
    tr_trainer *t = tr_create(&c, folder("fixed"), false, NULL, NULL, &st);
    CHECK(t, "%s", st.message);
    float *before = malloc(t->model->count * sizeof *before);
    size_t first, last;
    for (int i = 0; i < 10; i++) {
        tr_row row;
        if (i == 4) memcpy(before, t->adam.ema, t->model->count * sizeof *before); /* g's own phase ends */
        CHECK(tr_step(t, &row, &st) == TS_OK && !row.skip, "%s", st.message);
    }
    nn_model_range(t->model, NN_G, &first, &last);
    CHECK(!memcmp(before + first, t->model->value + first, (last - first) * sizeof *before),
          "g is not the one that is saved");
    for (size_t i = first; i < last; i++) CHECK(t->model->grad[i] == 0, "a gradient reaches g");
    nn_model_range(t->model, NN_H, &first, &last);
    CHECK(memcmp(before + first, t->model->value + first, (last - first) * sizeof *before) != 0, "h has not");
    tr_destroy(&t);
    CHECK(tr_config_set_assignment(&c, "model.h_width=0", &st) == TS_OK &&
              tr_config_set_assignment(&c, "model.iterations=0", &st) == TS_OK,
          "%s", st.message);
    CHECK(tr_config_check(&c, &st) == TS_INVALID && strstr(st.message, "g_rate"), "nothing to train: %s", st.message);
}

TEST(flash_loss_is_the_renderer_s_rmse)
{
    float *maps;
    const nn_input in = photographs(2, 12, 6, &maps);
    float *other = numbers(2 * 12 * 12 * 9, 8, -0.5f, 0.5f);
    ag_tape *t = tape_create(false);
    ag_value *loss = ag_flash_loss(t, ag_constant(t, ts_view(other, (ts_shape){2, 12, 12, 9})),
                                   ag_constant(t, in.image), &in.view);
    double rmse[2];
    for (int n = 0; n < 2; n++)
        rd_flash_rmse(in.grid, other + n * 12 * 12 * 9, 9, &in.view, in.image.data + n * 12 * 12 * 3, &rmse[n]);
    check_tape(t);
    CHECK(fabs((double)loss->t.data[0] - (rmse[0] + rmse[1]) / 2) < 1e-7, "%g, not the mean of %g and %g",
          (double)loss->t.data[0], rmse[0], rmse[1]);
    loss = ag_flash_loss(t, ag_constant(t, ts_view(maps, (ts_shape){2, 12, 12, 9})), ag_constant(t, in.image),
                         &in.view);
    CHECK(loss->t.data[0] == 0, "the truth has a loss of %g", (double)loss->t.data[0]);
}
