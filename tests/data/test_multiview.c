/* Captures as lgd-eval compares them, and the conventions of a set of map folders. */
#include "data/file.h"
#include "data/materials/procedural.h"
#include "eval/multiview.h"
#include "eval/set_ini.h"
#include "eval/sets.h"
#include "infer/capture.h"
#include "render/render.h"
#include "tests/test.h"
#include <math.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>

enum { SIZE = 32, IMAGES = 5 };

/* A procedural material under five lights and cameras, of which no two are alike, in colours that no light has by
 * itself. */
static void make(io_material *m, io_capture *c, float brightness)
{
    ts_status st = {0};
    const io_procedural p = {.seed = 9, .families = io_family_mask("classic")};
    CHECK(io_material_create(m, SIZE, &st) == TS_OK && io_capture_create(c, IMAGES, SIZE, &st) == TS_OK, "%s",
          st.message);
    io_procedural_make(&p, 4, m);
    c->side = 12;
    const float colour[3] = {2, 1.5f, 1};
    for (int k = 0; k < 3; k++) c->power[k] = colour[k];
    for (int i = 0; i < IMAGES; i++) {
        rd_view v = {.kind = RD_POINT,
                     .camera = {0.1f * (float)i, -0.2f, 1.1f},
                     .light = {-0.1f, 0.15f * (float)i, 0.8f},
                     .power = brightness};
        memcpy(c->camera[i], v.camera, sizeof v.camera);
        memcpy(c->light[i], v.light, sizeof v.light);
        float *image = c->image + (size_t)i * SIZE * SIZE * 3;
        rd_render(rd_grid_full(SIZE), m->maps, MAP_CHANNELS, &v, false, image);
        for (int k = 0; k < SIZE * SIZE * 3; k++) image[k] = fminf(image[k] * colour[k % 3], 1);
    }
}

TEST(eval_capture_of_the_truth_scores_nothing)
{
    for (float brightness = 0.5f; brightness < 3; brightness *= 2) {
        io_material m = {0};
        io_capture c;
        make(&m, &c, brightness);
        const ev_row row = ev_capture_score(&c, 1, m.maps, MAP_CHANNELS, true, NULL);
        CHECK(fabs(row.value[EV_EXPOSURE] / (double)brightness - 1) < 1e-3, "exposure %g, not %g",
              row.value[EV_EXPOSURE], (double)brightness);
        CHECK(row.value[EV_RENDER] < 1e-4 && row.value[EV_SSIM] > 0.9999 && row.value[EV_FLIP] < 1e-2,
              "RMSE %g, SSIM %g, FLIP %g", row.value[EV_RENDER], row.value[EV_SSIM], row.value[EV_FLIP]);
        CHECK(isnan(row.value[EV_DIFFUSE]) && isnan(row.value[EV_ANGLE]), "the maps of a capture are known");
        for (int i = 0; i < SIZE * SIZE; i++) m.maps[i * MAP_CHANNELS + MAP_NORMAL] *= -1;
        CHECK(ev_capture_score(&c, 1, m.maps, MAP_CHANNELS, false, NULL).value[EV_RENDER] > 0.005,
              "mirrored normals score %g", ev_capture_score(&c, 1, m.maps, MAP_CHANNELS, false, NULL).value[EV_RENDER]);
        io_material_free(&m);
        io_capture_free(&c);
    }
}

/* The estimators see the picture that a white light of the flash's strength would have made from there. */
TEST(eval_capture_input_is_a_flash_photograph)
{
    io_material m = {0};
    io_capture c;
    static float input[SIZE * SIZE * 3], expected[SIZE * SIZE * 3];
    make(&m, &c, 1);
    ev_capture_input(&c, 1, false, input);
    const rd_view view = ev_capture_view(&c, 0);
    rd_render(rd_grid_full(SIZE), m.maps, MAP_CHANNELS, &view, true, expected);
    int compared = 0;
    for (int i = 0; i < SIZE * SIZE * 3; i++) {
        if (c.image[i] >= 1) continue; /* what the photograph lost */
        compared++;
        CHECK(fabsf(input[i] - expected[i]) < 1e-5f, "value %d: %g, not %g", i, (double)input[i], (double)expected[i]);
    }
    CHECK(compared > SIZE * SIZE, "only %d values", compared);
    const float *l = view.light;
    const float far2 = l[0] * l[0] + l[1] * l[1] + l[2] * l[2], strength = view.power / far2 * l[2] / sqrtf(far2);
    CHECK(fabsf(strength * RD_FLASH_DISTANCE * RD_FLASH_DISTANCE / RD_FLASH_POWER - 1) < 1e-5f,
          "at the centre the irradiance is %g", (double)strength);
    io_material_free(&m);
    io_capture_free(&c);
}

/* As taken, a picture loses its light's colour and keeps its brightness: what the file has below 1 is not burnt out. */
TEST(eval_capture_input_as_taken_is_as_bright)
{
    io_material m = {0};
    io_capture c;
    static float input[SIZE * SIZE * 3];
    float gain[3], flash[3];
    make(&m, &c, 1);
    for (int k = 0; k < 3; k++) c.power[k] /= 40; /* to the flash's brightness all of it would burn out */
    lgd_capture_gain(&c, true, gain);
    lgd_capture_gain(&c, false, flash);
    CHECK(fabsf(gain[0] * gain[1] * gain[2] - 1) < 1e-5f && flash[1] > 10, "gains of %g, %g", (double)gain[1],
          (double)flash[1]);
    for (int k = 0; k < 3; k++)
        CHECK(fabsf(flash[k] / gain[k] * gain[0] / flash[0] - 1) < 1e-5f &&
                  fabsf(gain[k] * c.power[k] / c.power[0] / gain[0] - 1) < 1e-5f,
              "colour %d has a gain of %g", k, (double)gain[k]);
    ev_capture_input(&c, 1, true, input);
    for (int i = 0; i < SIZE * SIZE * 3; i++) {
        const float want = fminf(c.image[i] * gain[i % 3], 1);
        CHECK(input[i] == want, "value %d: %g, not %g", i, (double)input[i], (double)want);
    }
    io_material_free(&m);
    io_capture_free(&c);
}

TEST(eval_multiview_sets)
{
    io_material m = {0};
    io_capture c, back = {0};
    ts_status st = {0};
    ev_set set;
    char path[300], spec[320];
    make(&m, &c, 1);
    for (int i = 0; i < 2; i++) {
        snprintf(path, sizeof path, "%s/%s", test_folder(), i ? "b" : "a.1");
        CHECK(mkdir(path, 0777) == 0 && io_write_capture(path, &c, &st) == TS_OK, "%s", st.message);
    }
    snprintf(spec, sizeof spec, "multiview:%s", test_folder());
    CHECK(ev_set_open(spec, NULL, &set, &st) == TS_OK && set.count == 2 && strcmp(set.entry[1], "b") == 0, "%s",
          st.message);
    CHECK(ev_set_load_capture(&set, 1, 16, &back, &st) == TS_OK && back.size == 16 && strcmp(back.name, "b") == 0, "%s",
          st.message);
    ev_set_close(&set);
    snprintf(spec, sizeof spec, "multiview:%s", path);
    CHECK(ev_set_open(spec, NULL, &set, &st) == TS_OK && set.count == 1, "%s", st.message);
    CHECK(ev_set_load_capture(&set, 0, 0, &back, &st) == TS_OK && back.images == IMAGES && strcmp(back.name, "b") == 0,
          "%s: %s", back.name, st.message);
    /* 8 bits of gamma are all that is lost */
    CHECK(ev_capture_score(&back, 1, m.maps, MAP_CHANNELS, false, NULL).value[EV_RENDER] < 0.003, "RMSE %g",
          ev_capture_score(&back, 1, m.maps, MAP_CHANNELS, false, NULL).value[EV_RENDER]);
    ev_set_close(&set);
    io_capture_free(&c);
    CHECK(io_capture_create(&c, 1, 8, &st) == TS_OK, "%s", st.message);
    c.camera[0][2] = c.light[0][2] = c.power[0] = c.power[1] = c.power[2] = 1;
    snprintf(path, sizeof path, "%s/one", test_folder());
    CHECK(mkdir(path, 0777) == 0 && io_write_capture(path, &c, &st) == TS_OK, "%s", st.message);
    snprintf(spec, sizeof spec, "multiview:%s", path);
    CHECK(ev_set_open(spec, NULL, &set, &st) == TS_OK && ev_set_load_capture(&set, 0, 0, &back, &st) == TS_FORMAT &&
              strstr(st.message, "one picture"),
          "%s", st.message);
    ev_set_close(&set);
    io_capture_free(&c);
    io_capture_free(&back);
    io_material_free(&m);
}

/* Twenty renderings by other people, with the maps that they were made from: our geometry and BRDF against theirs. */
TEST(eval_multiview_of_others)
{
    enum { N = 256, PICTURES = 20 };
    char path[400], to[400];
    ts_status st = {0};
    snprintf(path, sizeof path, "%s/multiview/dir_leatherXmarble/light_view_positions.txt", test_data());
    FILE *f = fopen(path, "r");
    if (!f) test_skip("%s is absent", path);
    char *camera = NULL, *bytes;
    size_t size;
    FILE *text = open_memstream(&camera, &size);
    CHECK(text, "open_memstream");
    for (char line[256]; fgets(line, sizeof line, f);)
        if (strchr(line, '\t')) fprintf(text, "%.*s\n", (int)strcspn(line, "\t"), line);
    fclose(f);
    fclose(text);
    const struct {
        const char *name, *content;
    } files[] = {{"camera_pos.txt", camera},
                 {"light_pos.txt", camera},
                 {"image_size.txt", "2"},
                 {"light_power.txt", "16,16,16"}};
    for (int i = 0; i < 4; i++) {
        snprintf(to, sizeof to, "%s/%s", test_folder(), files[i].name);
        CHECK(io_write_bytes(to, files[i].content, strlen(files[i].content), &st) == TS_OK, "%s", st.message);
    }
    for (int i = 0; i < PICTURES; i++) {
        snprintf(path, sizeof path, "%s/multiview/dir_leatherXmarble/%02d.png", test_data(), i);
        snprintf(to, sizeof to, "%s/%02d.png", test_folder(), i);
        CHECK(io_read_bytes(path, 1 << 24, &bytes, &size, &st) == TS_OK &&
                  io_write_bytes(to, bytes, size, &st) == TS_OK,
              "%s", st.message);
        free(bytes);
    }
    free(camera);
    io_capture c;
    io_image strip;
    io_material m = {0};
    snprintf(path, sizeof path, "%s/multiview/dir_leatherXmarble/gt_svbrdf.png", test_data());
    CHECK(io_read_capture(test_folder(), 0, IO_MAX_PIXELS_DEFAULT, &c, &st) == TS_OK && c.images == PICTURES &&
              c.size == N,
          "%s", st.message);
    CHECK(io_read_data(path, 3, 1 << 20, &strip, &st) == TS_OK && strip.width == 4 * N &&
              io_material_create(&m, N, &st) == TS_OK,
          "%s", st.message);
    for (int i = 0; i < N * N; i++) { /* normal | diffuse, gamma 2.2 | roughness | specular */
        const float *p = strip.data + ((size_t)(i / N) * 4 * N + (size_t)(i % N)) * 3;
        io_texel t = {.roughness = p[2 * N * 3]};
        for (int k = 0; k < 3; k++) {
            t.normal[k] = 2 * p[k] - 1;
            t.diffuse[k] = powf(p[N * 3 + k], 2.2f);
            t.specular[k] = p[3 * N * 3 + k];
        }
        t.normal[2] = fmaxf(t.normal[2], 1e-3f);
        io_texel_put(m.maps + (size_t)i * MAP_CHANNELS, &t);
    }
    const ev_row row = ev_capture_score(&c, 1, m.maps, MAP_CHANNELS, false, NULL);
    printf("RMSE %.4f, exposure %.3f\n", row.value[EV_RENDER], row.value[EV_EXPOSURE]);
    CHECK(row.value[EV_RENDER] < 0.05 && fabs(row.value[EV_EXPOSURE] - 1) < 0.1, "RMSE %g, exposure %g",
          row.value[EV_RENDER], row.value[EV_EXPOSURE]);
    for (int i = 0; i < PICTURES; i++) c.light[i][1] *= -1, c.camera[i][1] *= -1;
    CHECK(ev_capture_score(&c, 1, m.maps, MAP_CHANNELS, false, NULL).value[EV_RENDER] > 2 * row.value[EV_RENDER],
          "y may as well point down");
    io_image_free(&strip);
    io_material_free(&m);
    io_capture_free(&c);
}

static ts_code told(const char *text, const io_map_convention *option, io_map_convention *c, ts_status *st)
{
    char path[256];
    snprintf(path, sizeof path, "%s/set.ini", test_folder());
    *st = (ts_status){0};
    CHECK(io_write_bytes(path, text, strlen(text), st) == TS_OK, "%s", st->message);
    return ev_set_ini(test_folder(), option, c, st);
}

TEST(eval_set_ini)
{
    io_map_convention c;
    const io_map_convention option = {.normal = IO_NORMAL_GL};
    ts_status st = {0};
    CHECK(ev_set_ini(test_folder(), NULL, &c, &st) == TS_OK && !c.normal && !c.workflow && !c.colour,
          "without a file: %s", st.message);
    CHECK(told("\xef\xbb\xbf# a set\r\n normal=directx ; y down\r\n\r\nworkflow = specular\ncolour = linear", NULL, &c,
               &st) == TS_OK,
          "%s", st.message);
    CHECK(c.normal == IO_NORMAL_DX && c.workflow == IO_WORKFLOW_SPECULAR && c.colour == IO_ENCODING_LINEAR, "%d %d %d",
          c.normal, c.workflow, c.colour);
    CHECK(told("normal = directx\ncolour = srgb\n", &option, &c, &st) == TS_OK && c.normal == IO_NORMAL_GL &&
              c.colour == IO_ENCODING_SRGB,
          "the option does not win");
    static const char *const wrong[] = {"normal = up\n", "normals = opengl\n", "workflow\n",
                                        "\n\nroughness = linear\n"};
    for (size_t i = 0; i < sizeof wrong / sizeof *wrong; i++)
        CHECK(told(wrong[i], NULL, &c, &st) == TS_FORMAT && strstr(st.message, i == 3 ? "set.ini:3" : "set.ini:1"),
              "%zu: %s", i, st.message);
}

/* The same files under both of everything: what is given decides, and what stays ambiguous is refused. */
TEST(eval_maps_as_told)
{
    ts_status st = {0};
    char path[300], spec[300];
    snprintf(path, sizeof path, "%s/m", test_folder());
    CHECK(mkdir(path, 0777) == 0, "mkdir");
    static const struct {
        const char *name;
        float value[3];
    } files[] = {{"diffuse.png", {0.5f, 0.5f, 0.5f}},
                 {"normal.png", {0.5f, 0.8f, 0.9f}},
                 {"roughness.png", {0.4f, 0.4f, 0.4f}},
                 {"metallic.png", {1, 1, 1}},
                 {"specular.png", {0.2f, 0.2f, 0.2f}}};
    for (int i = 0; i < 5; i++) {
        io_image image;
        CHECK(io_image_create(&image, 4, 4, 3, &st) == TS_OK, "%s", st.message);
        for (int k = 0; k < 4 * 4 * 3; k++) image.data[k] = files[i].value[k % 3];
        snprintf(path, sizeof path, "%s/m/%s", test_folder(), files[i].name);
        CHECK(io_write_png(path, &image, 16, false, &st) == TS_OK, "%s", st.message);
        io_image_free(&image);
    }
    snprintf(spec, sizeof spec, "maps:%s", test_folder());
    ev_set set;
    io_material m = {0};
    io_map_convention say = {0};
    /* a map folder's own set.ini wins over that of the set, the option over both */
    const struct {
        const char *name, *text;
    } ini[] = {{"set.ini", "workflow = metallic\nnormal = opengl\n"}, {"m/set.ini", "normal = directx\n"}};
    for (int i = 0; i < 2; i++) {
        snprintf(path, sizeof path, "%s/%s", test_folder(), ini[i].name);
        CHECK(io_write_bytes(path, ini[i].text, strlen(ini[i].text), &st) == TS_OK, "%s", st.message);
    }
    for (int i = 0; i < 2; i++) {
        say.normal = i ? IO_NORMAL_GL : IO_NORMAL_FROM_FILE;
        CHECK(ev_set_open(spec, &say, &set, &st) == TS_OK && set.count == 1 &&
                  ev_set_load(&set, 0, 4, &m, &st) == TS_OK,
              "%s", st.message);
        CHECK((io_texel_get(m.maps).normal[1] < 0) == (i == 0), "set.ini of the map folder, option %d", i);
        ev_set_close(&set);
    }
    for (int i = 0; i < 2; i++) {
        snprintf(path, sizeof path, "%s/%s", test_folder(), ini[i].name);
        CHECK(remove(path) == 0, "%s", path);
    }
    say = (io_map_convention){0};
    CHECK(ev_set_open(spec, &say, &set, &st) == TS_OK && ev_set_load(&set, 0, 4, &m, &st) == TS_INVALID &&
              strstr(st.message, "workflow"),
          "two workflows: %s", st.message);
    ev_set_close(&set);
    say.workflow = IO_WORKFLOW_SPECULAR;
    CHECK(ev_set_open(spec, &say, &set, &st) == TS_OK && ev_set_load(&set, 0, 4, &m, &st) == TS_INVALID &&
              strstr(st.message, "OpenGL"),
          "the normal's y: %s", st.message);
    ev_set_close(&set);
    for (int i = 0; i < 8; i++) {
        st = (ts_status){0};
        say = (io_map_convention){i & 1 ? IO_NORMAL_DX : IO_NORMAL_GL,
                                  i & 2 ? IO_WORKFLOW_SPECULAR : IO_WORKFLOW_METALLIC,
                                  i & 4 ? IO_ENCODING_LINEAR : IO_ENCODING_SRGB};
        CHECK(ev_set_open(spec, &say, &set, &st) == TS_OK && ev_set_load(&set, 0, 4, &m, &st) == TS_OK, "%s",
              st.message);
        const io_texel t = io_texel_get(m.maps);
        const float half = i & 4 ? 0.5f : io_srgb_to_linear(0.5f), fifth = i & 4 ? 0.2f : io_srgb_to_linear(0.2f);
        CHECK((t.normal[1] < 0) == (i & 1), "case %d: normal y %g", i, (double)t.normal[1]);
        CHECK(fabsf(t.diffuse[0] - (i & 2 ? half : 0)) < 1e-3f && fabsf(t.specular[0] - (i & 2 ? fifth : half)) < 1e-3f,
              "case %d: diffuse %g, specular %g", i, (double)t.diffuse[0], (double)t.specular[0]);
        ev_set_close(&set);
    }
    io_material_free(&m);
}
