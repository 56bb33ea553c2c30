/* A g that learns from another what that says when it is told its own guess of the camera. */
#include "nn/weights/weights.h"
#include "tensor/maps.h"
#include "tests/support/networks.h"
#include "tests/support/runs.h"

enum { FINE = 4 * SIDE, COUNT = 3 };

/* Its last layers, which begin as zero, have values. */
static nn_model *teacher(void)
{
    static const char *const last[] = {"g.detail.conv5.weight", "g.scene.numbers.weight"};
    nn_model *m = guessing();
    for (size_t k = 0; k < sizeof last / sizeof *last; k++) {
        const nn_param *p = nn_model_find(m, last[k]);
        ts_rng r = ts_rng_make(5, TS_STREAM_TEST, k);
        CHECK(p, "no %s", last[k]);
        for (size_t i = 0; i < p->count; i++) m->value[p->offset + i] = ts_rng_range(&r, -0.1f, 0.1f);
    }
    return m;
}

/* Of photograph n the largest difference in the channels [first, last). */
static double apart(const ag_value *a, const ag_value *b, int n, int first, int last)
{
    const ts_shape s = a->t.shape;
    const int64_t pixels = (int64_t)s.h * s.w;
    double most = 0;
    for (int64_t i = n * pixels; i < (n + 1) * pixels; i++)
        for (int k = first; k < last; k++)
            most = farther(most, fabs((double)a->t.data[i * s.c + k] - (double)b->t.data[i * s.c + k]));
    return most;
}

/* Where the camera is known a teacher says what it says anyway. Where it is not, its diffuse is what it says of a
 * camera at the distance that it guesses, and all else is its first answer. */
TEST(teacher_is_told_its_own_guess)
{
    static const unsigned char known[COUNT] = {0, NN_KNOWN_CAMERA, NN_KNOWN_POWER};
    unsigned char told[COUNT];
    rd_view views[COUNT], guessed[COUNT];
    nn_model *m = teacher();
    nn_input in = photographs(COUNT, FINE, 33, NULL);
    for (int n = 0; n < COUNT; n++) views[n] = rd_view_from(rd_flash(), 1.5);
    in.views = views, in.known = known, in.given = 1;
    ag_tape *one = tape_create(false), *two = tape_create(false), *three = tape_create(false);
    nn_guess taught, first, second;
    CHECK(tr_taught(one, m, &in, &taught), "%s", ag_status(one)->message);
    CHECK(nn_guess_from(two, m, &in, &first), "%s", ag_status(two)->message);
    for (int n = 0; n < COUNT; n++) {
        const double log_height = (double)first.scene->t.data[(size_t)n * 2 * RD_SCENE_NUMBERS + RD_SCENE_DISTANCE];
        guessed[n] = views[n];
        told[n] = known[n] | NN_KNOWN_CAMERA;
        if (known[n] & NN_KNOWN_CAMERA) continue;
        guessed[n].camera[0] = guessed[n].camera[1] = 0;
        guessed[n].camera[2] = (float)((double)RD_FLASH_DISTANCE * exp(log_height));
    }
    in.views = guessed, in.known = told;
    CHECK(nn_guess_from(three, m, &in, &second), "%s", ag_status(three)->message);
    for (int n = 0; n < COUNT; n++) {
        const bool knew = known[n] & NN_KNOWN_CAMERA;
        CHECK(apart(taught.maps, second.maps, n, MAP_DIFFUSE, MAP_NORMAL) < 1e-5, "diffuse of %d", n);
        CHECK(knew || apart(first.maps, second.maps, n, MAP_DIFFUSE, MAP_NORMAL) > 1e-4,
              "%d: the camera changes nothing", n);
        CHECK(apart(taught.maps, first.maps, n, MAP_NORMAL, MAP_CHANNELS) == 0, "the other maps of %d", n);
        CHECK(apart(taught.spread, first.spread, n, 0, NN_SPREADS) == 0, "spread of %d", n);
        CHECK(apart(taught.scene, first.scene, n, 0, 2 * RD_SCENE_NUMBERS) == 0, "scene of %d", n);
    }
    ag_tape_destroy(&one), ag_tape_destroy(&two), ag_tape_destroy(&three);
    nn_model_free(&m);
    free(in.image.data);
}

typedef struct losses {
    double first, last, spread;
} losses;

static void on_step(const tr_row *row, void *user)
{
    losses *l = user;
    if (row->step == 1) l->first = row->loss, l->spread = row->spread;
    l->last = row->loss;
}

static ts_code run(const tr_config *c, const char *where, losses *l, ts_status *st)
{
    const tr_listener listener = {.step = on_step, .user = l};
    *st = (ts_status){0};
    tr_trainer *t = tr_create(c, where, false, NULL, &listener, st);
    if (!t) return st->code;
    const ts_code code = tr_run(t, st);
    tr_destroy(&t);
    return code;
}

static tr_config lesson(const char *path)
{
    static const char *const keys[] = {"model.g_width=4",    "model.g_width_max=8",     "model.g_levels=2",
                                       "model.g_size=16",    "model.unshuffle=4",       "model.g_detail=6",
                                       "model.g_trunk=1",    "model.conditions=yes",    "model.spread=yes",
                                       "model.scene=yes",    "model.descent=posterior", "model.h_width=0",
                                       "data.patch=64",      "validate.every=0",        "train.window=0",
                                       "train.steps=0",      "train.iterations_min=0",  "train.iterations_max=0",
                                       "data.told_view=0.5", "train.pretrain_steps=24", "train.pretrain_rate=0.003"};
    ts_status st = {0};
    tr_config c = small();
    for (size_t i = 0; i < sizeof keys / sizeof *keys; i++)
        CHECK(tr_config_set_assignment(&c, keys[i], &st) == TS_OK, "%s", st.message);
    snprintf(c.train.teacher, sizeof c.train.teacher, "%s", path);
    return c;
}

/* A student that begins elsewhere comes nearer; one that begins as its teacher, who was told every camera, has nothing
 * to learn. */
TEST(trainer_learns_from_a_teacher)
{
    ts_status st = {0};
    losses l, same;
    char path[700], other[700];
    snprintf(path, sizeof path, "%s/last.safetensors", folder("school"));
    snprintf(other, sizeof other, "%s/missing.safetensors", test_folder());
    tr_config c = lesson(path);
    *c.train.teacher = 0;
    CHECK(run(&c, folder("school"), &l, &st) == TS_OK, "%s", st.message);
    snprintf(c.train.teacher, sizeof c.train.teacher, "%s", path);
    c.train.seed = 77;
    CHECK(run(&c, folder("pupil"), &l, &st) == TS_OK, "%s", st.message);
    CHECK(l.last < l.first - 0.1, "the pupil's loss goes from %g to %g", l.first, l.last);
    c.data.told_view = 1, c.train.pretrain_steps = 1;
    snprintf(c.train.init, sizeof c.train.init, "%s", path);
    CHECK(run(&c, folder("master"), &same, &st) == TS_OK, "%s", st.message);
    CHECK(same.spread == 0, "the teacher differs from itself by %g", same.spread);

    snprintf(c.train.teacher, sizeof c.train.teacher, "%s", other);
    CHECK(run(&c, folder("none"), &l, &st) != TS_OK && strstr(st.message, "missing"), "%s", st.message);
    snprintf(c.train.teacher, sizeof c.train.teacher, "%s", path);
    c.train.steps = 1;
    CHECK(run(&c, folder("none"), &l, &st) == TS_INVALID && strstr(st.message, "train.steps"), "%s", st.message);
    c.train.steps = 0, c.data.patch = 32;
    CHECK(run(&c, folder("none"), &l, &st) == TS_INVALID && strstr(st.message, "data.patch"), "%s", st.message);
    c.data.patch = 128, c.arch.g_size = 32;
    CHECK(run(&c, folder("none"), &l, &st) == TS_INVALID && strstr(st.message, "128 x 128"), "%s", st.message);
}

/* A student that begins as its teacher, who was told every camera, keeps all but the normals, which it learns from the
 * materials. */
TEST(trainer_learns_normals_beside_a_teacher)
{
    ts_status st = {0};
    losses diffuse, normals, rmse;
    char path[700];
    snprintf(path, sizeof path, "%s/last.safetensors", folder("masters"));
    tr_config c = lesson(path);
    *c.train.teacher = 0, c.data.told_view = 1;
    CHECK(run(&c, folder("masters"), &diffuse, &st) == TS_OK, "%s", st.message);
    snprintf(c.train.teacher, sizeof c.train.teacher, "%s", path);
    snprintf(c.train.init, sizeof c.train.init, "%s", path);
    const int64_t steps = c.train.pretrain_steps;
    c.train.pretrain_steps = 1; /* there is nothing to learn */
    CHECK(run(&c, folder("of_diffuse"), &diffuse, &st) == TS_OK, "%s", st.message);
    c.train.lesson = TR_LESSON_NORMALS, c.train.normal_rmse = 0;
    CHECK(run(&c, folder("of_normals"), &normals, &st) == TS_OK, "%s", st.message);
    CHECK(normals.first > diffuse.first + 0.01, "the materials' normals are the teacher's: %g, %g", normals.first,
          diffuse.first);
    CHECK(normals.spread == 0, "the teacher differs from itself by %g", normals.spread);
    c.train.normal_rmse = 5;
    CHECK(run(&c, folder("of_squares"), &rmse, &st) == TS_OK, "%s", st.message);
    CHECK(rmse.first > normals.first + 0.1, "train.normal_rmse adds nothing: %g, %g", normals.first, rmse.first);
    losses mse;
    c.train.normal_rmse = 0, c.train.normal_mse = 20;
    CHECK(run(&c, folder("of_means"), &mse, &st) == TS_OK, "%s", st.message);
    CHECK(mse.first > normals.first + 0.01 && fabs(mse.first - rmse.first) > 1e-3,
          "train.normal_mse: %g, without it %g, the roots %g", mse.first, normals.first, rmse.first);
    c.train.normal_rmse = 5, c.train.normal_mse = 0;
    *c.train.init = 0, c.train.seed = 77, c.train.pretrain_steps = steps;
    CHECK(run(&c, folder("of_both"), &rmse, &st) == TS_OK, "%s", st.message);
    CHECK(rmse.last < rmse.first - 0.1, "the loss goes from %g to %g", rmse.first, rmse.last);

    *c.train.teacher = 0;
    CHECK(run(&c, folder("none"), &rmse, &st) == TS_INVALID && strstr(st.message, "train.lesson"), "%s", st.message);
}

typedef struct hearing {
    tr_trainer *t;
    int known, all, asked;
} hearing;

/* After each step: the materials taught it exactly where tr_measured says so, and the teacher was not asked of
 * pictures that these teach. */
static void count_known(const tr_row *row, void *user)
{
    hearing *h = user;
    const tr_config *c = &h->t->config;
    const bool known = isfinite(row->render_start);
    CHECK(known == tr_measured(c, row->step - 1), "step %lld", (long long)row->step);
    CHECK(known || row->spread < 1, "the teacher's are %g away", row->spread);
    h->known += known;
    for (int i = 0; i < RD_LOSS_VIEWS; i++)
        CHECK((h->t->views[i].kind == RD_POINT) == (i >= RD_LOSS_VIEWS - c->train.flash_views), "view %d", i);
    for (int i = 0; i < h->t->batch; i++) {
        const int sure = NN_KNOWN_CAMERA | NN_KNOWN_POWER, told = h->t->known[i];
        CHECK(((told & sure) == sure) == known, "step %lld, photograph %d: %d is told", (long long)row->step, i, told);
        h->all += known && told == NN_KNOWN_ALL, h->asked += !known && (told & sure);
    }
}

/* After each step without a teacher: all of a measured one's photographs are given with camera, light and power. */
static void count_given(const tr_row *row, void *user)
{
    hearing *h = user;
    const int sure = NN_KNOWN_CAMERA | NN_KNOWN_LIGHT | NN_KNOWN_POWER;
    int all = 0;
    for (int i = 0; i < h->t->batch; i++) all += (h->t->known[i] & sure) == sure;
    const bool measured = tr_measured(&h->t->config, row->step - 1);
    if (measured) CHECK(all == h->t->batch, "step %lld: %d are given", (long long)row->step, all);
    h->known += measured, h->asked += !measured, h->all += !measured && all == h->t->batch;
}

/* Half of the steps are of pictures whose light and camera are measured, which are told and have no other light and no
 * tone curve; the others are the teacher's, from which a student that begins as it does not go far. */
TEST(trainer_learns_known_cameras_beside_a_teacher)
{
    enum { STEPS = 400 };
    ts_status st = {0};
    losses l;
    int known = 0, flash = 0;
    hearing h = {0};
    char path[700];
    snprintf(path, sizeof path, "%s/last.safetensors", folder("tellers"));
    tr_config c = lesson(path);
    c.data.tone = c.data.ambient = c.data.exposure = 1, c.data.flash = 0.2, c.data.fov_min = 20, c.data.fov_max = 70;
    for (int step = 0; step < STEPS; step++) {
        c.data.measured = 0;
        CHECK(!tr_measured(&c, step), "a share of 0 has measured steps");
        c.data.measured = 0.5;
        tr_config measured;
        const tr_config *m = tr_taken_with(&c, step, &measured);
        CHECK(m == (tr_measured(&c, step) ? &measured : &c), "step %d is taken with another's", step);
        if (m == &c) continue;
        const rd_view planned = rd_flash();
        tr_shot shot;
        float *maps = calloc((size_t)SIDE * SIDE, MAP_CHANNELS * sizeof(float)),
              *image = calloc((size_t)SIDE * SIDE, 3 * sizeof(float));
        CHECK(maps && image, "no memory");
        tr_photographs(m, 3, (uint64_t)step, 1, SIDE, maps, NULL, 1, image, &shot);
        CHECK(shot.told_view && shot.told_power && shot.is.tone == 0 && shot.is.ambient == 0, "step %d", step);
        known++, flash += memcmp(&shot.is.view, &planned, sizeof planned) == 0;
        free(maps), free(image);
    }
    CHECK(known > STEPS * 2 / 5 && known < STEPS * 3 / 5, "%d of %d steps are known", known, STEPS);
    CHECK(flash > known * 2 / 5 && flash < known * 3 / 5, "%d of %d under the flash", flash, known);

    *c.train.teacher = 0, c.data.told_power = 0.2;
    const tr_listener plain = {.step = count_given, .user = &h};
    h.t = tr_create(&c, folder("tellers"), false, NULL, &plain, &st);
    CHECK(h.t && tr_run(h.t, &st) == TS_OK, "%s", st.message);
    CHECK(h.known > 4 && h.asked > 4 && h.all == 0, "%d measured, of %d others %d", h.known, h.asked, h.all);
    tr_destroy(&h.t);
    h = (hearing){0};
    snprintf(c.train.teacher, sizeof c.train.teacher, "%s", path);
    snprintf(c.train.init, sizeof c.train.init, "%s", path);
    c.train.lesson = TR_LESSON_KNOWN, c.train.seed = 77;
    const tr_listener listener = {.step = count_known, .user = &h};
    c.data.told_power = 0.5, c.train.flash_views = 2;
    h.t = tr_create(&c, folder("hearers"), false, NULL, &listener, &st);
    CHECK(h.t && tr_run(h.t, &st) == TS_OK, "%s", st.message);
    CHECK(h.known > 4 && h.known < 20, "%d of 24 steps are known", h.known);
    CHECK(h.all > h.known / 4 && h.asked > 0, "light known in %d, the teacher told something in %d", h.all, h.asked);
    tr_destroy(&h.t);

    c.data.measured = 0;
    CHECK(run(&c, folder("none"), &l, &st) == TS_INVALID && strstr(st.message, "data.measured"), "%s", st.message);
    c.data.measured = 0.5, c.data.sheet = 0.5;
    CHECK(run(&c, folder("none"), &l, &st) == TS_INVALID && strstr(st.message, "data.sheet"), "%s", st.message);
}
