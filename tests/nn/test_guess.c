/* g at full detail: what it reads of the scene, what it says of its errors, and how it begins as a smaller g. */
#include "nn/weights/weights.h"
#include "tests/support/networks.h"

enum { FINE = 4 * SIDE };

static nn_arch detailed(void)
{
    nn_arch a = tiny();
    a.g_unshuffle = 4, a.g_detail = 6, a.g_trunk = 1, a.h_width = 0, a.descent = NN_DESCENT_POSTERIOR;
    a.conditions = a.spread = a.scene = true;
    return a;
}

/* Every last layer that begins as zero gets values. */
static void enliven_guess(nn_model *m)
{
    static const char *const last[] = {"g.detail.conv5.weight", "g.scene.numbers.weight", "g.trunk1.conv2.weight",
                                       "g.half.conv5.weight"};
    for (size_t k = 0; k < sizeof last / sizeof *last; k++) {
        const nn_param *p = nn_model_find(m, last[k]);
        if (k == 3 && m->arch.g_half == 0) continue;
        CHECK(p, "no %s", last[k]);
        ts_rng r = ts_rng_make(9, TS_STREAM_TEST, k);
        for (size_t i = 0; i < p->count; i++) m->value[p->offset + i] = ts_rng_range(&r, -0.1f, 0.1f);
    }
}

static void guess(nn_model *m, const nn_input *in, float *maps, float *spread, float *scene)
{
    ag_tape *tape = tape_create(false);
    nn_guess g;
    CHECK(nn_guess_from(tape, m, in, &g), "%s", ag_status(tape)->message);
    CHECK(ts_same(g.maps->t.shape, (ts_shape){1, FINE, FINE, 9}), "the maps' shape");
    CHECK(ts_same(g.spread->t.shape, (ts_shape){1, FINE, FINE, NN_SPREADS}), "the spread's shape");
    CHECK(ts_same(g.scene->t.shape, (ts_shape){1, 1, 1, 2 * RD_SCENE_NUMBERS}), "the scene's shape");
    memcpy(maps, g.maps->t.data, sizeof(float) * FINE * FINE * 9);
    memcpy(spread, g.spread->t.data, sizeof(float) * FINE * FINE * NN_SPREADS);
    memcpy(scene, g.scene->t.data, sizeof(float) * 2 * RD_SCENE_NUMBERS);
    ag_tape_destroy(&tape);
}

static double difference(const float *a, const float *b, size_t n)
{
    double most = 0;
    for (size_t i = 0; i < n; i++) most = farther(most, fabs((double)a[i] - (double)b[i]));
    return most;
}

static float one[FINE * FINE * 9], two[FINE * FINE * 9], s1[FINE * FINE * NN_SPREADS], s2[FINE * FINE * NN_SPREADS];

/* What is not known of a view changes nothing; what is known does. */
TEST(guess_reads_what_is_known)
{
    const nn_arch a = detailed();
    nn_model *m = create(&a, 71);
    enliven_guess(m);
    nn_input in = photographs(1, FINE, 72, NULL);
    rd_view near = rd_flash(), far = near;
    far.camera[2] = far.light[2] = 2;
    far.light[0] = 0.2f;
    far.power = 9;
    float n1[2 * RD_SCENE_NUMBERS], n2[2 * RD_SCENE_NUMBERS];
    for (int known = 0; known <= NN_KNOWN_ALL; known++) {
        const unsigned char flags = (unsigned char)known;
        in.known = &flags;
        in.views = &near;
        guess(m, &in, one, s1, n1);
        in.views = &far;
        guess(m, &in, two, s2, n2);
        const double maps = difference(one, two, FINE * FINE * 9), scene = difference(n1, n2, 2 * RD_SCENE_NUMBERS);
        CHECK(known ? maps > 1e-7 && scene > 1e-9 : maps == 0 && scene == 0, "known %d: maps %g, scene %g", known, maps,
              scene);
    }
    nn_model_free(&m);
    free(in.image.data);
}

/* Some rows at a time, as without gradients, the full size is what it is as a whole. */
static void same_in_bands(int unshuffle, int half, bool exact)
{
    nn_arch a = detailed();
    a.g_half = half, a.g_unshuffle = unshuffle, a.g_size = 2 * NN_BAND + 8; /* two bands and a half */
    nn_model *m = create(&a, 75);
    enliven_guess(m);
    const unsigned char known[2] = {NN_KNOWN_ALL, 0};
    const rd_view views[2] = {rd_flash(), rd_flash()};
    nn_input in = photographs(2, nn_arch_side(&a), 76, NULL);
    in.views = views;
    in.known = known;
    ag_tape *whole = tape_create(true), *bands = tape_create(false);
    nn_guess g[2];
    ag_compute_set(whole, (ts_compute){.exact = exact});
    ag_compute_set(bands, (ts_compute){.exact = exact});
    CHECK(nn_guess_from(whole, m, &in, &g[0]) && nn_guess_from(bands, m, &in, &g[1]), "no guess");
    const size_t pixels = (size_t)ts_pixels(g[0].maps->t.shape);
    const double maps = difference(g[0].maps->t.data, g[1].maps->t.data, 9 * pixels),
                 spread = difference(g[0].spread->t.data, g[1].spread->t.data, NN_SPREADS * pixels);
    /* Winograd's tiles of 4 x 4 pixels begin elsewhere in bands of squares of 2, and at half of the side the last ones
     * read rows beyond the band's margin, which move the rounding of their other rows. */
    const double bound = exact || (unshuffle == 4 && half == 0) ? 0 : 1e-5;
    CHECK(maps <= bound && spread <= bound, "squares of %d, half %d, exact %d: maps %g, spread %g", unshuffle, half,
          exact, maps, spread);
    ag_tape_destroy(&whole);
    ag_tape_destroy(&bands);
    nn_model_free(&m);
    free(in.image.data);
}

TEST(guess_does_not_depend_on_its_bands)
{
    for (int unshuffle = 2; unshuffle <= 4; unshuffle += 2)
        for (int half = 0; half <= 16; half += 16)
            for (int exact = 0; exact < 2; exact++) same_in_bands(unshuffle, half, exact);
}

/* More residual blocks, and what is made at half of the side, begin as nothing. */
TEST(guess_begins_as_that_of_a_g_with_less)
{
    nn_arch small = detailed(), a = detailed();
    a.g_trunk = 3, a.g_half = 5;
    nn_model *from = create(&small, 77), *m = create(&a, 78);
    enliven_guess(from);
    char path[256];
    ts_status st = {0};
    int taken, left;
    snprintf(path, sizeof path, "%s/less.safetensors", test_folder());
    CHECK(!nn_model_save(from, from->value, path, NULL, 0, &st), "%s", st.message);
    CHECK(!nn_model_init_from(m, path, NULL, &taken, &left, &st) && left == 14, "%s, %d are left", st.message, left);
    const unsigned char nothing = 0;
    const rd_view view = rd_flash();
    nn_input in = photographs(1, FINE, 79, NULL);
    in.known = &nothing;
    in.views = &view;
    float n1[2 * RD_SCENE_NUMBERS], n2[2 * RD_SCENE_NUMBERS];
    guess(from, &in, one, s1, n1);
    guess(m, &in, two, s2, n2);
    CHECK(difference(one, two, FINE * FINE * 9) == 0 && difference(s1, s2, FINE * FINE * NN_SPREADS) == 0,
          "the maps differ by %g", difference(one, two, FINE * FINE * 9));
    enliven_guess(m);
    guess(m, &in, two, s2, n2);
    CHECK(difference(one, two, FINE * FINE * 9) > 1e-4, "what was added changes nothing");
    nn_model_free(&from);
    nn_model_free(&m);
    free(in.image.data);
}

/* Turned by a quarter, the mean over four orientations turns with the photograph, and so does the light's guess. */
TEST(guess_turns_with_the_photograph)
{
    const nn_arch a = detailed();
    nn_model *m = create(&a, 73);
    enliven_guess(m);
    nn_input in = photographs(1, FINE, 74, NULL);
    const unsigned char nothing = 0;
    const rd_view view = rd_flash();
    in.known = &nothing;
    in.views = &view;
    in.orientations = 4;
    float n1[2 * RD_SCENE_NUMBERS], n2[2 * RD_SCENE_NUMBERS];
    guess(m, &in, one, s1, n1);
    float *turned = malloc(sizeof(float) * FINE * FINE * 3), *own = in.image.data;
    for (int y = 0; y < FINE; y++) /* a quarter counter-clockwise: (x, y) from (FINE - 1 - y, x) */
        for (int x = 0; x < FINE; x++)
            memcpy(turned + (y * FINE + x) * 3, own + (x * FINE + FINE - 1 - y) * 3, 3 * sizeof(float));
    in.image = ts_view(turned, in.image.shape);
    guess(m, &in, two, s2, n2);
    double most = 0, spread = 0;
    for (int y = 0; y < FINE; y++)
        for (int x = 0; x < FINE; x++) {
            const float *p = one + (x * FINE + FINE - 1 - y) * 9, *q = two + (y * FINE + x) * 9;
            for (int c = 0; c < 9; c++) {
                const float want = c == 3 ? -p[4] : c == 4 ? p[3] : p[c];
                most = farther(most, fabs((double)q[c] - (double)want));
            }
            spread = fmax(
                spread,
                difference(s1 + (x * FINE + FINE - 1 - y) * NN_SPREADS, s2 + (y * FINE + x) * NN_SPREADS, NN_SPREADS));
        }
    CHECK(most < 2e-5 && spread < 2e-5, "maps %g, spread %g", most, spread);
    CHECK(fabs((double)(n2[RD_SCENE_LIGHT_X] + n1[RD_SCENE_LIGHT_Y])) < 2e-5 &&
              fabs((double)(n2[RD_SCENE_LIGHT_Y] - n1[RD_SCENE_LIGHT_X])) < 2e-5,
          "the light %g %g became %g %g", (double)n1[RD_SCENE_LIGHT_X], (double)n1[RD_SCENE_LIGHT_Y],
          (double)n2[RD_SCENE_LIGHT_X], (double)n2[RD_SCENE_LIGHT_Y]);
    const float *e1 = n1 + RD_SCENE_NUMBERS, *e2 = n2 + RD_SCENE_NUMBERS;
    for (int v = RD_SCENE_LIGHT_X; v <= RD_SCENE_CAMERA_X; v += 2) {
        CHECK(fabsf(e1[v] - e1[v + 1]) > 1e-3f, "errors that are alike say nothing");
        CHECK(fabsf(e2[v] - e1[v + 1]) < 2e-5f && fabsf(e2[v + 1] - e1[v]) < 2e-5f, "errors %g %g became %g %g",
              (double)e1[v], (double)e1[v + 1], (double)e2[v], (double)e2[v + 1]);
    }
    nn_model_free(&m);
    free(own);
    free(turned);
}

/* A g that reads squares and conditions begins as the g that reads their means: of a photograph without detail its
 * coarse maps are the same, and it adds nothing yet. */
TEST(guess_begins_as_a_smaller_g)
{
    nn_arch small = tiny(), a = detailed();
    small.h_width = 0;
    nn_model *from = create(&small, 75), *m = create(&a, 76);
    char path[256];
    ts_status st = {0};
    int taken, left;
    snprintf(path, sizeof path, "%s/small.safetensors", test_folder());
    CHECK(!nn_model_save(from, from->value, path, NULL, 0, &st), "%s", st.message);
    CHECK(!nn_model_init_from(m, path, NULL, &taken, &left, &st), "%s", st.message);
    float *plain = malloc(sizeof(float) * FINE * FINE * 3);
    for (int i = 0; i < FINE * FINE * 3; i++) plain[i] = 0.2f + 0.1f * (float)(i % 3);
    const unsigned char nothing = 0;
    const rd_view view = rd_flash();
    nn_input in = {.image = ts_view(plain, (ts_shape){1, FINE, FINE, 3}),
                   .grid = rd_grid_full(FINE),
                   .views = &view,
                   .known = &nothing,
                   .given = 1};
    float scene[2 * RD_SCENE_NUMBERS];
    guess(m, &in, one, s1, scene);
    ag_tape *tape = tape_create(false);
    const ag_value *maps = nn_predict(tape, from, &in);
    CHECK(maps, "%s", ag_status(tape)->message);
    double most = 0; /* tanh is applied before the one enlargement and after the other */
    for (int i = 0; i < FINE * FINE * 9; i++) most = farther(most, fabs((double)one[i] - (double)maps->t.data[i]));
    CHECK(most < 0.02, "the maps differ by %g", most);
    ag_tape_destroy(&tape);
    nn_model_free(&from);
    nn_model_free(&m);
    free(plain);
}

/* An architecture that cannot be is refused by its key. */
TEST(guess_architectures_are_checked)
{
    ts_status st = {0};
    for (int i = 0; i < 6; i++) {
        nn_arch a = detailed();
        if (i == 0) a.images = 2;
        if (i == 1) a.g_unshuffle = 1;
        if (i == 2) a.scene = false;
        if (i == 3) a.h_width = 4;
        if (i == 4) a.coarse_steps = 1;
        if (i == 5) a.g_half = 4, a.g_unshuffle = 3;
        st = (ts_status){0};
        CHECK(nn_arch_check(&a, &st) == TS_INVALID && *st.message, "%d is accepted", i);
    }
    const nn_arch a = detailed();
    CHECK(!nn_arch_check(&a, &st), "%s", st.message);
}

static void begin_from(const nn_model *from, nn_model *m, int *left)
{
    char path[256];
    ts_status st = {0};
    int taken;
    snprintf(path, sizeof path, "%s/from.safetensors", test_folder());
    CHECK(!nn_model_save(from, from->value, path, NULL, 0, &st), "%s", st.message);
    CHECK(!nn_model_init_from(m, path, NULL, &taken, left, &st) && taken + *left == m->params, "%s", st.message);
}

/* A g with wider levels and wider squares, whose further blocks add nothing yet, computes what it began as. */
TEST(guess_of_a_narrower_g_is_the_same)
{
    nn_arch narrow = detailed(), wide = detailed();
    narrow.g_half = wide.g_half = 4;
    wide.g_width += 3, wide.g_width_max += 5, wide.g_detail = 15, wide.g_trunk = 2;
    nn_model *from = create(&narrow, 81), *m = create(&wide, 82);
    enliven_guess(from);
    int left;
    begin_from(from, m, &left);
    CHECK(left == 3, "%d are left, not the second block's", left);
    nn_input in = photographs(1, FINE, 83, NULL);
    float a[2 * RD_SCENE_NUMBERS], b[2 * RD_SCENE_NUMBERS];
    guess(from, &in, one, s1, a);
    guess(m, &in, two, s2, b);
    CHECK(difference(one, two, FINE * FINE * 9) < 2e-5 && difference(s1, s2, FINE * FINE * NN_SPREADS) < 2e-5 &&
              difference(a, b, 2 * RD_SCENE_NUMBERS) < 2e-5,
          "the maps differ by %g, the spread by %g, the scene by %g", difference(one, two, FINE * FINE * 9),
          difference(s1, s2, FINE * FINE * NN_SPREADS), difference(a, b, 2 * RD_SCENE_NUMBERS));
    nn_model_free(&from);
    nn_model_free(&m);
}

/* The way up of a g with fewer levels is the upper part of a deeper one's. */
TEST(guess_begins_as_the_upper_levels_of_a_deeper_g)
{
    nn_arch deep = detailed(), flat = detailed();
    deep.g_width_max = flat.g_width_max = deep.g_width;
    flat.g_levels = deep.g_levels - 1;
    nn_model *from = create(&deep, 84), *m = create(&flat, 85);
    int left;
    begin_from(from, m, &left);
    CHECK(left == 0, "%d are left", left);
    for (int i = 0; i < m->params; i++) {
        char name[sizeof m->param->name];
        const nn_param *p = &m->param[i];
        snprintf(name, sizeof name, "%s", p->name);
        if (!strncmp(name, "g.up", 4)) name[4]++;
        const nn_param *q = nn_model_find(from, name);
        CHECK(q && q->count == p->count &&
                  !memcmp(m->value + p->offset, from->value + q->offset, p->count * sizeof(float)),
              "%s is not the deeper one's %s", p->name, name);
    }
    nn_model_free(&from);
    nn_model_free(&m);
}
