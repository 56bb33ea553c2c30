/* What lgd-eval measures and how it sums up. */
#include "data/materials/procedural.h"
#include "eval/estimate.h"
#include "eval/report.h"
#include "eval/sets.h"
#include "eval/sheet.h"
#include "nn/weights/weights.h"
#include "render/error.h"
#include "tests/test.h"
#include <math.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>

enum { SIZE = 16 };

static void make_case(io_material *m, float *image, rd_view *views, ev_case *c)
{
    ts_status st = {0};
    const io_procedural p = {.seed = 9, .families = io_family_mask("classic")};
    CHECK(io_material_create(m, SIZE, &st) == TS_OK, "%s", st.message);
    io_procedural_make(&p, 4, m);
    ts_rng rng = ts_rng_make(2, TS_STREAM_EVAL, 0);
    rd_eval_views(&rng, RD_EVAL_VIEWS, views);
    ev_photograph(m, &(ev_photo){rd_flash(), 1, 0, 1, 1}, image);
    *c = ev_case_of_maps(m, image, views, false);
}

TEST(eval_the_truth_scores_zero_and_an_offset_what_it_is)
{
    io_material m = {0};
    static float image[SIZE * SIZE * 3], maps[SIZE * SIZE * MAP_CHANNELS];
    rd_view views[RD_EVAL_VIEWS];
    ev_case c;
    make_case(&m, image, views, &c);
    ev_row row = ev_score(&c, m.maps, MAP_CHANNELS);
    for (int k = 0; k <= EV_ANGLE; k++)
        CHECK(row.value[k] == 0, "the truth has %s error %g", ev_metric_name[k], row.value[k]);
    CHECK(isnan(row.value[EV_SSIM]) && isnan(row.value[EV_FLIP]), "what was not asked for has a value");
    c.perceptual = true;
    row = ev_score(&c, m.maps, MAP_CHANNELS);
    CHECK(fabs(row.value[EV_SSIM] - 1) < 1e-12 && row.value[EV_FLIP] == 0, "the truth has SSIM %g and FLIP %g",
          row.value[EV_SSIM], row.value[EV_FLIP]);
    memcpy(maps, m.maps, sizeof maps);
    for (int i = 0; i < SIZE * SIZE; i++) {
        float *r = &m.maps[i * MAP_CHANNELS + MAP_ROUGHNESS];
        *r = fminf(*r, 0.5f); /* room for the offset */
        maps[i * MAP_CHANNELS + MAP_ROUGHNESS] = *r + 0.2f;
    }
    row = ev_score(&c, maps, MAP_CHANNELS);
    CHECK(fabs(row.value[EV_ROUGHNESS] - 0.1) < 1e-5, "roughness error %g, not 0.1", row.value[EV_ROUGHNESS]);
    CHECK(row.value[EV_DIFFUSE] == 0 && row.value[EV_SPECULAR] == 0 && row.value[EV_NORMAL] == 0 &&
              row.value[EV_ANGLE] == 0 && row.value[EV_RENDER] > 0,
          "other maps are touched");
    CHECK(row.value[EV_SSIM] < 1 && row.value[EV_FLIP] > 0, "SSIM %g and FLIP %g see nothing", row.value[EV_SSIM],
          row.value[EV_FLIP]);
    io_material_free(&m);
}

TEST(eval_measures_every_step_as_its_maps_score)
{
    io_material m = {0};
    static float image[SIZE * SIZE * 3], first[SIZE * SIZE * MAP_CHANNELS], last[SIZE * SIZE * MAP_CHANNELS];
    rd_view views[RD_EVAL_VIEWS];
    ev_case c;
    ts_status st = {0};
    char path[300];
    make_case(&m, image, views, &c);
    snprintf(path, sizeof path, "%s/w.safetensors", test_folder());
    for (int channels = MAP_CHANNELS; channels <= MAP_CHANNELS + 1; channels++) {
        nn_arch a = nn_arch_default();
        a.channels = channels;
        a.g_width = a.g_width_max = 4;
        a.g_levels = 2;
        a.g_size = 16;
        a.h_width = 4;
        a.h_gru = 4;
        nn_model *model = nn_model_create(&a, &st);
        CHECK(model, "%s", st.message);
        nn_model_init(model, 1);
        CHECK(nn_model_save(model, model->value, path, NULL, 0, &st) == TS_OK, "%s", st.message);
        ev_estimator e;
        CHECK(ev_method_parse("lgd", path, 2, &e, &st) == TS_OK && ev_open(&e, &st) == TS_OK, "%s", st.message);
        ev_row row[3], again[3];
        double seconds[3];
        int step[EV_POINTS];
        const int points = ev_points(&e, step);
        CHECK(points == 3 && step[0] == 0 && step[2] == 2, "%d points", points);
        CHECK(ev_estimate(&e, &c, step, points, 1, row, seconds, first, last, &st) == TS_OK, "%s", st.message);
        const ev_row start = ev_score(&c, first, MAP_CHANNELS), end = ev_score(&c, last, MAP_CHANNELS);
        CHECK(memcmp(&start, &row[0], sizeof start) == 0 && memcmp(&end, &row[2], sizeof end) == 0,
              "rows differ from their maps' scores");
        CHECK(memcmp(first, last, sizeof first) != 0, "refinement does nothing");
        CHECK(ev_estimate(&e, &c, step, points, 3, again, seconds, NULL, last, &st) == TS_OK &&
                  memcmp(row, again, sizeof row) == 0,
              "again gives other numbers");
        CHECK(seconds[0] <= seconds[1] && seconds[1] <= seconds[2], "times run backward");
        for (size_t i = 0; i < e.net->count; i++) e.net->value[i] = NAN;
        ag_freeze(e.tape, false);
        CHECK(ev_estimate(&e, &c, step, points, 1, again, seconds, NULL, last, &st) == TS_NUMERIC,
              "damaged weights have a score: %s", st.message);
        st = (ts_status){0};
        ev_close(&e);
        nn_model_free(&model);
    }
    io_material_free(&m);
}

TEST(eval_noise_is_seeded_and_none_is_exact)
{
    io_material m = {0};
    static float clean[SIZE * SIZE * 3], a[SIZE * SIZE * 3], b[SIZE * SIZE * 3];
    rd_view views[RD_EVAL_VIEWS];
    ev_case c;
    make_case(&m, clean, views, &c);
    ev_photograph(&m, &(ev_photo){rd_flash(), 1, 0.5f, 1, 7}, a);
    ev_photograph(&m, &(ev_photo){rd_flash(), 1, 0.5f, 1, 7}, b);
    CHECK(memcmp(a, b, sizeof a) == 0 && memcmp(a, clean, sizeof a) != 0, "noise is not a function of its seed");
    ev_photograph(&m, &(ev_photo){rd_flash(), 1, 0.5f, 1, 8}, b);
    CHECK(memcmp(a, b, sizeof a) != 0, "two materials have the same noise");
    io_material_free(&m);
}

TEST(eval_summary_is_mean_and_deviation)
{
    const char *const names[] = {"one", "two"};
    ev_subject method = {.label = "m", .points = 2};
    int step[] = {0, 1};
    ev_report r = {.sets = 2, .set_name = names, .method = &method, .methods = 1, .step = step, .columns = 2};
    ts_status st = {0};
    static const double value[] = {1, 2, 6, 5};
    for (int i = 0; i < 4; i++) {
        CHECK(ev_report_add(&r, i / 3, "m", &st) == i, "%s", st.message);
        CHECK(isnan(r.result[i].seconds[0]) && isnan(r.result[i].row[1].value[0]), "what was not measured is a number");
        r.result[i].seconds[0] = 0;
        r.result[i].seconds[1] = value[i];
        for (int k = 0; k < EV_METRICS; k++) {
            r.result[i].row[0].value[k] = value[i] + k;
            r.result[i].row[1].value[k] = 10 * value[i];
        }
    }
    ev_row mean, deviation;
    CHECK(ev_report_summary(&r, 0, 0, &mean, &deviation) == 3, "three materials");
    for (int k = 0; k < EV_METRICS; k++)
        CHECK(k == EV_OVER_FLAT || fabs(mean.value[k] - 3 - k) < 1e-12, "mean %g", mean.value[k]);
    CHECK(fabs(mean.value[EV_OVER_FLAT] - mean.value[EV_NORMAL] / mean.value[EV_FLAT]) < 1e-12, "not the quotient");
    for (int k = 0; k < EV_METRICS; k++)
        CHECK(fabs(deviation.value[k] - sqrt(7)) < 1e-12, "deviation %g", deviation.value[k]);
    CHECK(ev_report_summary(&r, 1, 1, &mean, &deviation) == 1 && mean.value[0] == 50 && deviation.value[0] == 0,
          "one material has no spread");
    CHECK(ev_report_summary(&r, -1, 1, &mean, &deviation) == 4 && fabs(mean.value[2] - 35) < 1e-12, "all sets: %g",
          mean.value[2]);
    CHECK(ev_report_seconds(&r, 0, 1) == 2 && ev_report_seconds(&r, -1, 1) == 3.5, "medians %g and %g",
          ev_report_seconds(&r, 0, 1), ev_report_seconds(&r, -1, 1));
    ev_report_free(&r);
}

TEST(eval_csv_quotes_what_needs_it)
{
    const char *const names[] = {"maps:a,b \"c\""};
    ev_subject method = {.label = "d:x=1,y=2", .points = 1, .bytes = 7};
    int step[] = {20};
    ev_report r = {.sets = 1,
                   .set_name = names,
                   .model = "m",
                   .isa = "base",
                   .method = &method,
                   .methods = 1,
                   .step = step,
                   .columns = 1,
                   .threads = 1};
    ts_status st = {0};
    char path[256], line[256] = "";
    CHECK(ev_report_add(&r, 0, "plain", &st) == 0, "%s", st.message);
    r.result[0].row[0] = (ev_row){{0.5, 0.25, 0.125, 0, 1, 12, NAN, 0.75, 2, NAN, 0.5, 2}};
    for (int k = EV_BAND; k < EV_METRICS; k++) r.result[0].row[0].value[k] = NAN;
    r.result[0].seconds[0] = 1.5;
    r.result[0].peak[0] = 2e9;
    CHECK(ev_report_write(&r, test_folder(), &st) == TS_OK, "%s", st.message);
    snprintf(path, sizeof path, "%s/results.csv", test_folder());
    FILE *f = fopen(path, "r");
    CHECK(f && fgets(line, sizeof line, f), "%s is missing", path);
    CHECK(
        strcmp(line,
               "set,material,method,step,diffuse,specular,roughness,normal,render,angle,ssim,flip,exposure,lpips,flat,"
               "over_flat,band_2_8,band_8_32,band_32_64,band_64_128,residue_diffuse,residue_specular,residue_roughness,"
               "residue_hue,relief\n") == 0,
        "header: %s", line);
    CHECK(fgets(line, sizeof line, f) &&
              strcmp(line,
                     "\"maps:a,b "
                     "\"\"c\"\"\",plain,\"d:x=1,y=2\",20,0.500000,0.250000,0.125000,0.000000,1.000000,12.000000,,0."
                     "750000,2.000000,,0.500000,2.000000,,,,,,,,,\n") == 0,
          "row: %s", line);
    CHECK(!fgets(line, sizeof line, f), "more rows: %s", line);
    fclose(f);
    snprintf(path, sizeof path, "%s/times.csv", test_folder());
    f = fopen(path, "r");
    CHECK(f && fgets(line, sizeof line, f) && fgets(line, sizeof line, f), "%s is missing", path);
    CHECK(strcmp(line, "\"maps:a,b \"\"c\"\"\",1,\"d:x=1,y=2\",20,1.500000,2.000000,7,1\n") == 0, "row: %s", line);
    fclose(f);
    st = (ts_status){0};
    CHECK(ev_report_write(&r, "/proc/nowhere", &st) == TS_IO && strstr(st.message, "results.csv"), "%s", st.message);
    ev_report_free(&r);
}

TEST(eval_wrong_sets_are_named)
{
    ev_set set;
    static const char *const wrong[] = {"",
                                        "procedural",
                                        "procedural:",
                                        "procedural:1",
                                        "procedural:1,",
                                        "procedural:,3",
                                        "procedural:1,0",
                                        "procedural:-1,3",
                                        "procedural:1,3x",
                                        "procedural: 1,3",
                                        "procedural:1,99999999999",
                                        "procedural:99999999999999999999999,3",
                                        "pictures:x",
                                        "strips:",
                                        "proc:1,2",
                                        "stripsx:."};
    for (size_t i = 0; i < sizeof wrong / sizeof *wrong; i++) {
        ts_status st = {0};
        CHECK(ev_set_open(wrong[i], NULL, &set, &st) == TS_INVALID && strstr(st.message, wrong[i]), "'%s': %s",
              wrong[i], st.message);
    }
    char spec[300];
    ts_status st = {0};
    snprintf(spec, sizeof spec, "maps:%s", test_folder());
    CHECK(ev_set_open(spec, NULL, &set, &st) == TS_IO && strstr(st.message, test_folder()), "an empty folder: %s",
          st.message);
    st = (ts_status){0};
    snprintf(spec, sizeof spec, "strips:%s/absent", test_folder());
    CHECK(ev_set_open(spec, NULL, &set, &st) == TS_IO && strstr(st.message, "absent"), "an absent folder: %s",
          st.message);
}

TEST(eval_procedural_set_is_the_generator)
{
    ev_set set, other;
    ts_status st = {0};
    io_material a = {0}, b = {0};
    CHECK(ev_set_open("procedural:21,5", NULL, &set, &st) == TS_OK && set.count == 5, "%s", st.message);
    CHECK(ev_set_open("procedural:21,2", NULL, &other, &st) == TS_OK, "%s", st.message);
    const io_procedural p = {.seed = 21, .families = io_family_mask("classic")};
    CHECK(io_material_create(&b, SIZE, &st) == TS_OK, "%s", st.message);
    for (int i = 0; i < 2; i++) {
        CHECK(ev_set_load(&set, i, SIZE, &a, &st) == TS_OK, "%s", st.message);
        io_procedural_make(&p, (uint64_t)i, &b);
        CHECK(memcmp(a.maps, b.maps, SIZE * SIZE * MAP_CHANNELS * sizeof *a.maps) == 0, "material %d differs", i);
        CHECK(ev_set_identity(&set, i) == ev_set_identity(&other, i), "the size of the set changes the views");
    }
    CHECK(ev_set_identity(&set, 0) != ev_set_identity(&set, 1), "two materials have the same views");
    ev_set_close(&set);
    ev_set_close(&other);
    CHECK(ev_set_open("procedural:21,5,wood,rust", NULL, &set, &st) == TS_OK && set.count == 5, "%s", st.message);
    CHECK(set.families == (io_family_mask("wood") | io_family_mask("rust")), "mask %llx",
          (unsigned long long)set.families);
    ev_set_close(&set);
    CHECK(ev_set_open("procedural:21,5,wood,rusty", NULL, &set, &st) == TS_INVALID, "a family that is none");
    CHECK(strstr(st.message, "\"rusty\""), "%s", st.message);
    CHECK(ev_set_open("procedural:21,5,", NULL, &set, &st) == TS_INVALID, "an empty list was accepted");
    io_material_free(&a);
    io_material_free(&b);
}

TEST(eval_reads_strips_and_map_folders_in_order)
{
    char folder[200], path[300], spec[300];
    ts_status st = {0};
    io_material m = {0}, back = {0};
    io_image input = {0};
    rd_view views[RD_EVAL_VIEWS];
    static float image[SIZE * SIZE * 3];
    ev_case c;
    make_case(&m, image, views, &c);
    CHECK(io_image_create(&input, SIZE, SIZE, 3, &st) == TS_OK, "%s", st.message);
    snprintf(folder, sizeof folder, "%s/strips", test_folder());
    CHECK(mkdir(folder, 0777) == 0, "mkdir");
    static const char *const names[] = {"b.png", "a.png", ".hidden.png"};
    for (int i = 0; i < 3; i++) {
        snprintf(path, sizeof path, "%s/%s", folder, names[i]);
        CHECK(io_write_strip(path, &m, &input, &st) == TS_OK, "%s", st.message);
    }
    snprintf(path, sizeof path, "%s/notes.txt", folder);
    FILE *f = fopen(path, "w");
    CHECK(f && fclose(f) == 0, "cannot write %s", path);
    ev_set set;
    snprintf(spec, sizeof spec, "strips:%s", folder);
    CHECK(ev_set_open(spec, NULL, &set, &st) == TS_OK && set.count == 2, "%s", st.message);
    CHECK(ev_set_load(&set, 0, SIZE, &back, &st) == TS_OK && strcmp(back.name, "a") == 0, "%s: %s", back.name,
          st.message);
    for (int i = 0; i < SIZE * SIZE; i++) /* 16-bit panels; the folded roughness is the coarsest */
        CHECK(fabsf(back.maps[i * MAP_CHANNELS] - m.maps[i * MAP_CHANNELS]) < 1e-3f, "diffuse of pixel %d: %g, not %g",
              i, (double)back.maps[i * MAP_CHANNELS], (double)m.maps[i * MAP_CHANNELS]);
    ev_set_close(&set);

    snprintf(spec, sizeof spec, "maps:%s/maps", test_data());
    CHECK(ev_set_open(spec, NULL, &set, &st) == TS_OK && set.count > 1, "%s", st.message);
    for (int i = 1; i < set.count; i++) CHECK(strcmp(set.entry[i - 1], set.entry[i]) < 0, "not in order");
    CHECK(ev_set_load(&set, 1, SIZE, &back, &st) == TS_OK && back.size == SIZE && strcmp(back.name, set.entry[1]) == 0,
          "%s", st.message);
    ev_set_close(&set);
    io_material_free(&m);
    io_material_free(&back);
    io_image_free(&input);
}

TEST(eval_sheet_shows_the_input_first)
{
    io_material m = {0};
    static float image[SIZE * SIZE * 3];
    rd_view views[RD_EVAL_VIEWS];
    ev_case c;
    ts_status st = {0};
    char path[256];
    io_image back = {0};
    make_case(&m, image, views, &c);
    snprintf(path, sizeof path, "%s/sheet.png", test_folder());
    CHECK(ev_sheet_write(path, &c, m.maps, m.maps, &st) == TS_OK, "%s", st.message);
    CHECK(io_read_photo(path, 1 << 20, &back, &st) == TS_OK && back.width == 8 * SIZE && back.height == 3 * SIZE,
          "%d x %d %s", back.width, back.height, st.message);
    for (int row = 0; row < 3; row++) /* the truth as its own estimate: every row shows the input's picture */
        for (int i = 0; i < SIZE * 3; i++) {
            const float v = back.data[(size_t)row * SIZE * back.width * 3 + i];
            CHECK(fabsf(v - image[i]) < 0.01f, "row %d, value %d: %g, not %g", row, i, (double)v, (double)image[i]);
        }
    io_image_free(&back);
    io_material_free(&m);
}
