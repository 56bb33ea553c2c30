/* The public C API. */
#include "render/scene.h"
#include "tensor/budget.h"
#include "tests/support/inference.h"
#include <pthread.h>
#include <sys/resource.h>

/* Winograd's way, where the network is wide enough for it. */
TEST(infer_exact_and_fast_maps_are_near)
{
    enum { LARGE = 40, MAPS = LARGE * LARGE * 9 }; /* as many tiles as pay */
    nn_arch a = tiny();
    a.h_width = 32;
    a.h_gru = 24;
    lgd_model *m = load(a);
    static float image[LARGE * LARGE * 3], exact[MAPS], fast[MAPS], again[MAPS];
    lgd_error e;
    make_image(image, LARGE);
    const lgd_options direct = {.size = sizeof direct, .iterations = T, .exact = 1},
                      quick = {.size = sizeof quick, .iterations = T, .threads = 1},
                      three = {.size = sizeof three, .iterations = T, .threads = 3};
    CHECK(!lgd_estimate(m, image, LARGE, &direct, exact, &e) && !lgd_estimate(m, image, LARGE, &quick, fast, &e) &&
              !lgd_estimate(m, image, LARGE, &three, again, &e),
          "%s", e.message);
    double most = 0;
    for (int i = 0; i < MAPS; i++) most = farther(most, fabs((double)exact[i] - fast[i]));
    CHECK(most > 0 && most <= 1e-4, "the maps differ by %g", most);
    CHECK(!memcmp(fast, again, sizeof fast), "other maps with three threads");
    lgd_free(&m);
}

TEST(infer_same_bytes_for_any_threads_and_again)
{
    static float image[SIDE * SIDE * 3], one[VALUES], other[VALUES], small[9 * 3], small_maps[9 * MAP_CHANNELS];
    lgd_model *m = load(tiny());
    make_image(image, SIDE);
    make_image(small, 3);
    run(m, image, SIDE, T, 1, NULL, one);
    for (int threads = 0; threads <= 3; threads++) {
        run(m, small, 3, 1, threads, NULL, small_maps); /* another size in between leaves nothing behind */
        run(m, image, SIDE, T, threads, NULL, other);
        CHECK(memcmp(one, other, sizeof one) == 0, "%d threads give other bytes", threads);
    }
    lgd_free(&m);
}

static bool in_range(const float *maps, int side)
{
    for (int i = 0; i < side * side; i++) {
        const float *p = maps + i * MAP_CHANNELS;
        for (int c = 0; c < MAP_CHANNELS; c++) {
            const bool normal = c == MAP_NORMAL || c == MAP_NORMAL + 1;
            if (!(p[c] >= (normal ? -1 : 0) && p[c] <= 1)) return false;
        }
        if (p[MAP_NORMAL] * p[MAP_NORMAL] + p[MAP_NORMAL + 1] * p[MAP_NORMAL + 1] > 1) return false;
    }
    return true;
}

/* Calls on several threads, each with its own image and options; again[2]: what it gave, the second time while the
 * others run. */
enum { AT_ONCE = 40 }; /* pixels: Winograd's way pays */
typedef struct caller {
    lgd_model *model;
    lgd_options options;
    float image[AT_ONCE * AT_ONCE * 3], again[2][AT_ONCE * AT_ONCE * MAP_CHANNELS];
    int code[2];
} caller;

static void *call_twice(void *user)
{
    caller *c = user;
    for (int i = 0; i < 2; i++) c->code[i] = lgd_estimate(c->model, c->image, AT_ONCE, &c->options, c->again[i], NULL);
    return NULL;
}

TEST(infer_calls_at_once_are_calls_in_turn)
{
    enum { CALLERS = 5 };
    static caller c[CALLERS];
    static float alone[AT_ONCE * AT_ONCE * MAP_CHANNELS];
    const lgd_options options[CALLERS] = {
        {.size = sizeof(lgd_options), .iterations = T, .threads = 1},
        {.size = sizeof(lgd_options), .iterations = T, .threads = 2},
        {.size = sizeof(lgd_options), .iterations = 1, .threads = 1, .exact = 1},
        {.size = sizeof(lgd_options), .iterations = T, .threads = 1, .precision = LGD_BF16},
        {.size = sizeof(lgd_options), .iterations = T, .threads = 3, .exact = 1}};
    pthread_t thread[CALLERS];
    nn_arch a = tiny();
    a.h_width = 32; /* so that the ways of computing differ */
    a.h_gru = 24;
    lgd_model *m = load(a), *fresh = load(a);
    int started = 0;
    for (int i = 0; i < CALLERS; i++) {
        c[i].model = m;
        c[i].options = options[i];
        make_image(c[i].image, AT_ONCE);
        c[i].image[5 * i] = 1;
    }
    while (started < CALLERS && !pthread_create(&thread[started], NULL, call_twice, &c[started])) started++;
    for (int i = 0; i < started; i++) pthread_join(thread[i], NULL);
    CHECK(started == CALLERS, "%d threads", started);
    for (int i = 0; i < CALLERS; i++) {
        CHECK(!lgd_estimate(fresh, c[i].image, AT_ONCE, &options[i], alone, NULL), "call %d", i);
        for (int k = 0; k < 2; k++)
            CHECK(!c[i].code[k] && !memcmp(c[i].again[k], alone, sizeof alone), "call %d: other bytes the time %d", i,
                  k);
    }
    lgd_free(&m);
    lgd_free(&fresh);
}

TEST(infer_any_image_of_any_size_gives_maps)
{
    static float image[35 * 35 * 3], maps[35 * 35 * MAP_CHANNELS];
    static const int sizes[] = {1, 2, 3, 5, 16, 17, 35};
    static const float values[] = {0, 1, 0.5f, 1e-30f, 1e30f, -3, NAN, INFINITY, -INFINITY};
    lgd_model *m = load(tiny());
    for (size_t s = 0; s < sizeof sizes / sizeof *sizes; s++)
        for (size_t v = 0; v < sizeof values / sizeof *values; v++) {
            const int side = sizes[s];
            trace t = {.stop_at = -1};
            for (int i = 0; i < side * side * 3; i++) image[i] = values[v];
            run(m, image, side, 2, 1, &t, maps);
            CHECK(in_range(maps, side), "an image of %g with side %d gives maps out of range", (double)values[v], side);
            for (int i = 0; i < t.calls; i++)
                CHECK(isfinite(t.rmse[i]), "rmse %g for an image of %g", t.rmse[i], (double)values[v]);
        }
    lgd_free(&m);
}

TEST(infer_bad_pixels_count_as_black_and_bright_ones_as_one)
{
    static float clean[SIDE * SIDE * 3], dirty[SIDE * SIDE * 3], a[VALUES], b[VALUES];
    lgd_model *m = load(tiny());
    make_image(clean, SIDE);
    for (int i = 0; i < SIDE * SIDE * 3; i += 7) clean[i] = i % 2 ? 0 : 1;
    memcpy(dirty, clean, sizeof dirty);
    static const float black[] = {NAN, -5, INFINITY, -INFINITY, -0.0f};
    for (int i = 0; i < SIDE * SIDE * 3; i += 7) dirty[i] = i % 2 ? black[i % 5] : 1 + (float)i;
    run(m, clean, SIDE, T, 1, NULL, a);
    run(m, dirty, SIDE, T, 1, NULL, b);
    CHECK(memcmp(a, b, sizeof a) == 0, "the same photograph gives other maps");
    lgd_free(&m);
}

/* The reported error is that of the rendering that lgd_render makes of the returned maps. */
TEST(infer_reported_rmse_is_that_of_the_rendering)
{
    static float image[SIDE * SIDE * 3], maps[VALUES], again[SIDE * SIDE * 3];
    const float flash[3] = {0, 0, RD_FLASH_DISTANCE};
    lgd_model *m = load(tiny());
    make_image(image, SIDE);
    for (int n = 0; n <= T; n++) {
        trace t = {.stop_at = -1};
        lgd_error e;
        run(m, image, SIDE, n, 1, &t, maps);
        CHECK(lgd_render(maps, SIDE, flash, flash, RD_FLASH_POWER, again, &e) == 0, "%s", e.message);
        double sum = 0;
        for (int i = 0; i < SIDE * SIDE * 3; i++) sum += pow(fmin(again[i], 1) - image[i], 2);
        const double rmse = sqrt(sum / (SIDE * SIDE * 3));
        CHECK(fabs(rmse - t.rmse[n]) < 1e-4, "step %d: reported %g, rendered %g", n, t.rmse[n], rmse);
    }
    lgd_free(&m);
}

TEST(infer_render_is_linear_in_power_and_dark_below)
{
    static float image[SIDE * SIDE * 3], maps[VALUES], a[SIDE * SIDE * 3], b[SIDE * SIDE * 3];
    const float light[3] = {0.2f, -0.3f, 0.8f}, below[3] = {0.2f, -0.3f, -0.8f}, camera[3] = {0, 0, 1};
    lgd_model *m = load(tiny());
    lgd_error e;
    make_image(image, SIDE);
    run(m, image, SIDE, 0, 1, NULL, maps);
    for (int i = 0; i < SIDE * SIDE; i++)
        maps[i * MAP_CHANNELS + MAP_NORMAL] = maps[i * MAP_CHANNELS + MAP_NORMAL + 1] = 0;
    CHECK(lgd_render(maps, SIDE, light, camera, 2, a, &e) == 0 && lgd_render(maps, SIDE, light, camera, 6, b, &e) == 0,
          "%s", e.message);
    double total = 0;
    for (int i = 0; i < SIDE * SIDE * 3; i++) {
        CHECK(fabsf(b[i] - 3 * a[i]) <= 1e-5f * b[i], "%g is not 3 x %g", (double)b[i], (double)a[i]);
        total += a[i];
    }
    CHECK(total > 0, "the light shows nothing");
    CHECK(lgd_render(maps, SIDE, below, camera, 2, a, &e) == 0, "%s", e.message);
    for (int i = 0; i < SIDE * SIDE * 3; i++) CHECK(a[i] == 0, "light from below shows %g", (double)a[i]);
    lgd_free(&m);
}

TEST(infer_wrong_arguments_are_named)
{
    static float image[4 * 3], maps[4 * MAP_CHANNELS];
    const float p[3] = {0, 0, 1}, bad[3] = {0, NAN, 1};
    lgd_model *m = load(tiny());
    static const struct {
        int side, iterations, threads;
        const char *word;
    } wrong[] = {{0, 1, 1, "side"},
                 {-3, 1, 1, "side"},
                 {1 << 30, 1, 1, "side"},
                 {2, -3, 1, "iterations"},
                 {2, 1 << 20, 1, "iterations"},
                 {2, 1, -1, "threads"},
                 {2, 1, 1 << 20, "threads"}};
    for (size_t i = 0; i < sizeof wrong / sizeof *wrong; i++) {
        lgd_error e = {0};
        const lgd_options o = {.size = sizeof o, .iterations = wrong[i].iterations, .threads = wrong[i].threads};
        CHECK(lgd_estimate(m, image, wrong[i].side, &o, maps, &e) != 0 && strstr(e.message, wrong[i].word),
              "case %zu: '%s'", i, e.message);
    }
    lgd_error e = {0};
    const lgd_options third = {.size = sizeof third, .iterations = 1, .precision = 2};
    CHECK(lgd_estimate(m, image, 2, &third, maps, &e) == TS_INVALID && strstr(e.message, "precision"), "'%s'",
          e.message);
    CHECK(lgd_estimate(NULL, image, 2, NULL, maps, &e) == TS_INVALID, "no model is taken");
    CHECK(lgd_estimate(m, NULL, 2, NULL, maps, &e) == TS_INVALID, "no image is taken");
    CHECK(lgd_estimate(m, image, 2, NULL, NULL, NULL) == TS_INVALID, "no maps are taken");
    CHECK(lgd_estimate(m, image, 2, NULL, maps, &e) == 0 && !e.message[0], "the defaults: %s", e.message);
    lgd_photo two[2] = {lgd_flash_photo(image), lgd_flash_photo(image)};
    CHECK(lgd_most_photos(m) == 1 && lgd_estimate_photos(m, two, 2, 2, NULL, maps, &e) == TS_INVALID &&
              strstr(e.message, "2 photographs"),
          "'%s'", e.message);
    two[0].power = 0;
    CHECK(lgd_estimate_photos(m, two, 1, 2, NULL, maps, &e) == TS_INVALID && strstr(e.message, "power"), "'%s'",
          e.message);
    two[0] = lgd_flash_photo(image);
    two[0].light[2] = -1;
    CHECK(lgd_estimate_photos(m, two, 1, 2, NULL, maps, &e) == TS_INVALID && strstr(e.message, "above"), "'%s'",
          e.message);
    CHECK(lgd_render(maps, 2, p, p, 1, image, &e) == 0, "%s", e.message);
    CHECK(lgd_render(NULL, 2, p, p, 1, image, &e) == TS_INVALID &&
              lgd_render(maps, 0, p, p, 1, image, &e) == TS_INVALID,
          "render takes anything");
    CHECK(lgd_render(maps, 2, bad, p, 1, image, &e) == TS_INVALID &&
              lgd_render(maps, 2, p, p, -1, image, &e) == TS_INVALID,
          "render takes any light");
    CHECK(!lgd_load(NULL, &e) && e.code == TS_INVALID, "no file is loaded");
    lgd_free(&m);
}

TEST(infer_load_names_a_bad_file)
{
    char path[256];
    lgd_error e = {0};
    snprintf(path, sizeof path, "%s/absent.safetensors", test_folder());
    CHECK(!lgd_load(path, &e) && e.code == TS_IO && strstr(e.message, path), "absent: '%s'", e.message);
    FILE *f = fopen(path, "w");
    CHECK(f && fputs("these are not weights at all, but they are long enough for a header", f) >= 0 && fclose(f) == 0,
          "cannot write %s", path);
    CHECK(!lgd_load(path, &e) && e.code == TS_FORMAT && strstr(e.message, path), "text: '%s'", e.message);
    CHECK(!strchr(e.message, '\n'), "more than a line: '%s'", e.message);
}

/* A caller that was compiled with another lgd.h: its options end earlier or later than ours. */
TEST(infer_options_of_another_size)
{
    struct later {
        lgd_options known;
        char more[24];
    } later;
    lgd_options earlier = {0};
    lgd_error e;
    static float image[SIDE * SIDE * 3], as_default[VALUES], maps[VALUES];
    lgd_model *m = load(tiny());
    make_image(image, SIDE);
    CHECK(!lgd_estimate(m, image, SIDE, NULL, as_default, &e), "%s", e.message);

    lgd_options_init(&earlier, offsetof(lgd_options, exact));
    CHECK(earlier.size == offsetof(lgd_options, exact) && earlier.iterations == -1 && earlier.orientations == 0,
          "more than the size was written");
    earlier.orientations = 77; /* beyond its end: not read */
    CHECK(!lgd_estimate(m, image, SIDE, &earlier, maps, &e), "%s", e.message);
    CHECK(!memcmp(maps, as_default, sizeof maps), "an absent field has not its default");

    lgd_options_init(&later.known, sizeof later);
    CHECK(!lgd_estimate(m, image, SIDE, &later.known, maps, &e), "%s", e.message);
    CHECK(!memcmp(maps, as_default, sizeof maps), "a field that is zero counts");
    later.more[7] = 1;
    CHECK(lgd_estimate(m, image, SIDE, &later.known, maps, &e) == TS_UNSUPPORTED && strstr(e.message, "newer liblgd"),
          "'%s'", e.message);

    lgd_options none = {.iterations = 1};
    CHECK(lgd_estimate(m, image, SIDE, &none, maps, &e) == TS_INVALID && strstr(e.message, "options.size is 0"), "'%s'",
          e.message);
    lgd_free(&m);
}

/* A field of view is a height of camera and light, at which the sample is as bright; what was taken is reported. */
TEST(infer_field_of_view)
{
    static float image[SIDE * SIDE * 3], told[VALUES], placed[VALUES], usual[VALUES];
    lgd_error e;
    lgd_model *m = load(tiny());
    make_image(image, SIDE);
    lgd_photo far = lgd_flash_photo(image), taken;
    const float d = 0.5f / tanf(0.5f * 30 / 57.29578f), farther = d / far.camera[2];
    lgd_options o = lgd_options_default();
    o.taken = &taken;
    CHECK(!lgd_estimate(m, image, SIDE, &o, usual, &e), "%s", e.message);
    CHECK(!memcmp(taken.camera, far.camera, sizeof far.camera) && taken.power == far.power && taken.image == image,
          "without a field of view the camera is %g high", (double)taken.camera[2]);
    o.fov = 30;
    CHECK(!lgd_estimate(m, image, SIDE, &o, told, &e), "%s", e.message);
    CHECK(fabsf(taken.camera[2] - d) < 1e-4f && fabsf(taken.light[2] - d) < 1e-4f &&
              fabsf(taken.power / (far.power * farther * farther) - 1) < 1e-4f,
          "30 degrees: %g high, power %g", (double)taken.camera[2], (double)taken.power);
    far = taken;
    o.fov = LGD_FOV_OF_PHOTO;
    CHECK(!lgd_estimate_photos(m, &far, 1, SIDE, &o, placed, &e), "%s", e.message);
    CHECK(!memcmp(told, placed, sizeof told), "told by the angle and by the place the maps differ");
    CHECK(memcmp(told, usual, sizeof told), "the steps do not see the field of view");
    static const double wrong[] = {180, 0.5, -3, NAN, INFINITY};
    for (size_t i = 0; i < sizeof wrong / sizeof *wrong; i++) {
        o.fov = wrong[i];
        CHECK(lgd_estimate(m, image, SIDE, &o, told, &e) == TS_INVALID && strstr(e.message, "fov"), "fov %g: '%s'",
              wrong[i], e.message);
    }
    lgd_free(&m);
}

TEST(infer_without_a_refiner_only_the_first_estimate)
{
    static float image[SIDE * SIDE * 3], maps[VALUES];
    nn_arch a = tiny();
    a.h_width = a.iterations = 0;
    lgd_model *m = load(a);
    make_image(image, SIDE);
    trace t = {.stop_at = -1};
    run(m, image, SIDE, -1, 1, &t, maps);
    CHECK(t.calls == 1 && in_range(maps, SIDE), "%d calls", t.calls);
    lgd_error e;
    const lgd_options o = {.size = sizeof o, .iterations = 1};
    CHECK(lgd_estimate(m, image, SIDE, &o, maps, &e) == TS_UNSUPPORTED && strstr(e.message, "refiner"), "'%s'",
          e.message);
    lgd_free(&m);
}

TEST(infer_ten_channels_give_nine_maps)
{
    static float image[SIDE * SIDE * 3], maps[VALUES];
    nn_arch a = tiny();
    a.channels = 10;
    lgd_model *m = load(a);
    make_image(image, SIDE);
    run(m, image, SIDE, 2, 1, NULL, maps);
    CHECK(in_range(maps, SIDE), "maps out of range");
    lgd_free(&m);
}

static long peak_kilobytes(void)
{
    struct rusage usage;
    getrusage(RUSAGE_SELF, &usage);
    return usage.ru_maxrss;
}

TEST(infer_more_memory_than_there_is_is_refused)
{
    ts_status st = {0};
    CHECK(ts_budget_check(1, &st) == TS_OK, "one byte: %s", st.message);
    CHECK(ts_budget_check(1e18, &st) == TS_NOMEM && strstr(st.message, "about 1e+09 GB") &&
              strstr(st.message, "--max-memory"),
          "'%s'", st.message);
    const double before = ts_budget_left();
    ts_budget_set(before / 2);
    CHECK(ts_budget_left() == before / 2 && ts_budget_check(before * 0.75, &st) == TS_NOMEM, "half of what there was");
    ts_budget_set(1e18);
    CHECK(ts_budget_check(1e17, &st) == TS_NOMEM && strstr(st.message, "are free"), "'%s'", st.message);
}

/* A few bytes of metadata ask for gigabytes: g_size is 4096 where the photograph has 16 pixels a side. */
TEST(infer_refuses_what_metadata_asks_for)
{
    static float image[SIDE * SIDE * 3], maps[VALUES];
    nn_arch a = tiny();
    a.g_size = 4096, a.g_width = a.g_width_max = 64;
    lgd_model *m = load(a);
    make_image(image, SIDE);
    ts_budget_set(2e9);
    const long before = peak_kilobytes();
    lgd_error e;
    const lgd_options o = {.size = sizeof o, .iterations = 0, .orientations = 2};
    CHECK(lgd_estimate(m, image, SIDE, &o, maps, &e) == TS_NOMEM && strstr(e.message, "4096 x 4096") &&
              strstr(e.message, "--max-memory"),
          "'%s'", e.message);
    CHECK(peak_kilobytes() - before < 64 << 10, "%ld KiB were taken first", peak_kilobytes() - before);
    lgd_free(&m);
}
