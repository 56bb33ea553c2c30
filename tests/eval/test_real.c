/* What lgd-eval measures where little or nothing is known: residues, bands, a peer's maps, photographs. */
#include "data/materials/procedural.h"
#include "eval/contact.h"
#include "eval/metrics/residue.h"
#include "eval/multiview.h"
#include "eval/panels.h"
#include "eval/sets.h"
#include "render/error.h"
#include "render/tone.h"
#include "tests/test.h"
#include <math.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>

enum { SIZE = 96 };

static const float grey[MAP_CHANNELS] = {-0.2f, 0.1f, 0.3f, 0, 0, 0.2f, -0.9f, -0.9f, -0.9f};

static float *constant(int size)
{
    float *maps = malloc((size_t)size * (size_t)size * sizeof grey);
    CHECK(maps, "out of memory");
    for (int i = 0; i < size * size; i++) memcpy(maps + i * MAP_CHANNELS, grey, sizeof grey);
    return maps;
}

static double radius(int i)
{
    return hypot((i % SIZE + 0.5) / SIZE - 0.5, ((double)(i - i % SIZE) / SIZE + 0.5) / SIZE - 0.5);
}

TEST(eval_residue_of_a_constant_is_zero_and_of_a_disk_its_value)
{
    float *maps = constant(SIZE);
    ev_residue r = ev_residue_of(SIZE, maps, MAP_CHANNELS);
    CHECK(r.diffuse < 1e-12 && r.specular < 1e-12 && r.roughness < 1e-12 && r.hue < 1e-12 && r.relief == 0,
          "a constant leaves %g %g %g %g %g", r.diffuse, r.specular, r.roughness, r.hue, r.relief);
    for (int i = 0; i < SIZE * SIZE; i++) {
        float *m = maps + i * MAP_CHANNELS;
        m[MAP_NORMAL] = 0.3f, m[MAP_NORMAL + 1] = -0.1f;
        if (radius(i) > 0.2) continue; /* between the disk and the ring */
        m[MAP_ROUGHNESS] -= 0.4f;
        for (int k = 0; k < 3; k++) m[MAP_SPECULAR + k] = 0;
        m[MAP_DIFFUSE] = -1;
    }
    r = ev_residue_of(SIZE, maps, MAP_CHANNELS);
    const double specular = (double)(rd_gamma(0.5f) - rd_gamma(0.05f)), red = (double)rd_gamma(0.4f),
                 green = (double)rd_gamma(0.55f), blue = (double)rd_gamma(0.65f);
    CHECK(fabs(r.specular - specular) < 1e-5 && fabs(r.roughness - 0.2) < 1e-5 && fabs(r.diffuse - red / 3) < 1e-5,
          "%g %g %g", r.diffuse, r.specular, r.roughness);
    CHECK(fabs(r.relief - sqrt((0.09 + 0.01) / 2)) < 1e-6, "relief %g", r.relief);
    const double ring = (red + green + blue) / 3 + 1e-3, disk = (green + blue) / 3 + 1e-3, dr = red / ring,
                 dg = green / disk - green / ring, db = blue / disk - blue / ring;
    CHECK(fabs(r.hue - sqrt((dr * dr + dg * dg + db * db) / 3)) < 1e-5, "hue %g", r.hue);
    /* brightness alone is no hue */
    for (int i = 0; i < SIZE * SIZE; i++) {
        float *m = maps + i * MAP_CHANNELS;
        for (int k = 0; k < 3; k++) m[MAP_DIFFUSE + k] = radius(i) > 0.2 ? grey[k] : (grey[k] + 1) / 2 - 1;
    }
    r = ev_residue_of(SIZE, maps, MAP_CHANNELS);
    CHECK(r.diffuse > 0.1 && r.hue < 2e-3, "half as bright: diffuse %g, hue %g", r.diffuse, r.hue);
    free(maps);
}

TEST(eval_bands_tell_scales_apart)
{
    static const int sizes[] = {96, 128, 90, 256};
    const double tau = 2 * 3.14159265358979323846;
    for (int s = 0; s < 4; s++) {
        const int n = sizes[s];
        float *truth = constant(n), *maps = constant(n);
        double c[EV_BANDS];
        for (int i = 0; i < n * n; i++) {
            const double x = (double)(i % n) / n, y = (double)(i - i % n) / n / n;
            float *t = truth + i * MAP_CHANNELS + MAP_NORMAL, *m = maps + i * MAP_CHANNELS + MAP_NORMAL;
            t[0] = (float)(0.2 * sin(tau * 5 * x) + 0.1 * sin(tau * (11 * x + 9 * y)));
            t[1] = (float)(0.2 * cos(tau * 40 * y));
            m[0] = (float)(0.1 * sin(tau * 5 * x) + 0.1 * cos(tau * 6 * y) + 0.3 * cos(tau * (11 * x + 9 * y)));
            m[1] = (float)(-0.1 * cos(tau * 40 * y));
        }
        ev_band_correlation(n, truth, MAP_CHANNELS, truth, MAP_CHANNELS, c);
        for (int k = 0; k < 3; k++) CHECK(fabs(c[k] - 1) < 1e-6, "%d: the truth has %g in band %d", n, c[k], k);
        CHECK(isnan(c[3]), "%d: a band without relief has %g", n, c[3]);
        ev_band_correlation(n, maps, MAP_CHANNELS, truth, MAP_CHANNELS, c);
        CHECK(fabs(c[0] - sqrt(0.5)) < 1e-5 && fabs(c[1]) < 1e-5 && fabs(c[2] + 1) < 1e-5, "%d: %g %g %g", n, c[0],
              c[1], c[2]);
        for (int i = 0; i < n * n; i++) memcpy(maps + i * MAP_CHANNELS, grey, sizeof grey);
        ev_band_correlation(n, maps, MAP_CHANNELS, truth, MAP_CHANNELS, c);
        CHECK(c[0] == 0 && c[1] == 0 && c[2] == 0, "%d: a flat map has %g %g %g", n, c[0], c[1], c[2]);
        free(truth);
        free(maps);
    }
}

/* A sheet of panels as the published ones are: first the truth as it is (and an input), then the peer's. */
static void write_sheet(const char *path, const io_material *m, bool truth)
{
    const int n = m->size, panels = truth ? 9 : 4;
    ts_status st = {0};
    io_image sheet;
    CHECK(io_image_create(&sheet, panels * n, n, 3, &st) == TS_OK, "%s", st.message);
    for (int i = 0; i < n * n; i++) {
        const io_texel t = io_texel_get(m->maps + i * MAP_CHANNELS);
        float *at = sheet.data + ((size_t)(i / n) * (size_t)sheet.width + (size_t)(i % n)) * 3;
        for (int k = 0; k < 3; k++) {
            const float peer[4] = {0.5f * t.normal[k] + 0.5f, powf(t.diffuse[k], 1 / 2.2f), 0.9f * t.roughness + 0.1f,
                                   powf(t.specular[k], 1 / 2.2f)},
                        known[5] = {io_linear_to_srgb(0.25f), 0.5f * t.normal[k] + 0.5f, t.diffuse[k], t.roughness,
                                    t.specular[k]};
            for (int p = 0; p < panels; p++)
                at[(size_t)p * (size_t)n * 3 + (size_t)k] = truth && p < 5 ? known[p] : peer[truth ? p - 5 : p];
        }
    }
    CHECK(io_write_png(path, &sheet, 16, false, &st) == TS_OK, "%s", st.message);
    io_image_free(&sheet);
}

TEST(eval_a_peer_that_has_the_truth_has_no_error)
{
    const io_procedural p = {.seed = 3, .families = io_family_mask("classic")};
    io_material m = {0}, truth = {0}, peer = {0};
    ts_status st = {0};
    ev_set set;
    char path[300], spec[320];
    float *image;
    double fov;
    CHECK(io_material_create(&m, 32, &st) == TS_OK, "%s", st.message);
    io_procedural_make(&p, 2, &m);
    for (int i = 0; i < 2; i++) {
        snprintf(path, sizeof path, "%s/%s", test_folder(), i ? "photos" : "peers");
        CHECK(mkdir(path, 0777) == 0, "%s", path);
        snprintf(path, sizeof path, "%s/%s/a.b.png", test_folder(), i ? "photos" : "peers");
        write_sheet(path, &m, i == 0);
    }
    snprintf(spec, sizeof spec, "peers:%s/peers", test_folder());
    CHECK(ev_set_open(spec, NULL, &set, &st) == TS_OK && set.count == 1, "%s", st.message);
    CHECK(ev_set_load_photo(&set, 0, 32, &image, &fov, &truth, &peer, &st) == TS_OK, "%s", st.message);
    CHECK(strcmp(truth.name, "a.b") == 0 && truth.size == 32 && peer.size == 32, "%s", truth.name);
    CHECK(fabsf(image[0] - 0.25f) < 1e-4f, "the input's first value is %g", (double)image[0]);
    rd_view views[RD_EVAL_VIEWS];
    ts_rng rng = ts_rng_make(2, TS_STREAM_EVAL, 0);
    rd_eval_views(&rng, RD_EVAL_VIEWS, views);
    const ev_case c = ev_case_of_maps(&truth, image, views, false);
    const ev_row row = ev_score(&c, peer.maps, MAP_CHANNELS), own = ev_score(&c, m.maps, MAP_CHANNELS);
    for (int k = 0; k <= EV_RENDER; k++)
        CHECK(row.value[k] < 1e-3 && own.value[k] < 1e-3, "%s: %g", ev_metric_name[k], row.value[k]);
    CHECK(row.value[EV_FLAT] > 0 && fabs(row.value[EV_OVER_FLAT] * row.value[EV_FLAT] - row.value[EV_NORMAL]) < 1e-12,
          "over flat: %g", row.value[EV_OVER_FLAT]);
    CHECK(row.value[EV_BAND] > 0.999, "band: %g", row.value[EV_BAND]);
    CHECK(isnan(row.value[EV_RESIDUE_HUE]), "a residue where the truth is known");
    /* half of all reflectances under twice the light look the same, but for Fresnel's rise at the edges */
    ev_case fitted = c;
    fitted.fit = fitted.perceptual = true;
    for (size_t i = 0; i < (size_t)m.size * (size_t)m.size; i++)
        for (int k = 0; k < 3; k++) {
            float *v = m.maps + i * MAP_CHANNELS;
            v[MAP_DIFFUSE + k] = 0.5f * (v[MAP_DIFFUSE + k] + 1) - 1;
            v[MAP_SPECULAR + k] = 0.5f * (v[MAP_SPECULAR + k] + 1) - 1;
        }
    const ev_row half = ev_score(&fitted, m.maps, MAP_CHANNELS), plain = ev_score(&c, m.maps, MAP_CHANNELS);
    CHECK(fabs(half.value[EV_EXPOSURE] - 2) < 0.05, "a factor of %g for one of 2", half.value[EV_EXPOSURE]);
    CHECK(half.value[EV_RENDER] < 0.1 * plain.value[EV_RENDER], "RMSE %g with the factor, %g without",
          half.value[EV_RENDER], plain.value[EV_RENDER]);
    CHECK(half.value[EV_FLIP] < 0.02 && half.value[EV_SSIM] > 0.99, "pictures are compared without the factor: %g, %g",
          half.value[EV_FLIP], half.value[EV_SSIM]);
    free(image);
    /* wrong shapes are named */
    CHECK(ev_read_four_panels(path, 32, &peer, &st) == TS_OK, "%s", st.message);
    CHECK(ev_read_nine_panels(path, 32, &image, &truth, &peer, &st) == TS_FORMAT && strstr(st.message, "a.b.png"), "%s",
          st.message);
    ev_set_close(&set);
    io_material_free(&m);
    io_material_free(&truth);
    io_material_free(&peer);
}

TEST(eval_photographs_and_their_peers)
{
    const io_procedural p = {.seed = 3, .families = io_family_mask("classic")};
    io_material m = {0}, truth = {0}, peer = {0};
    ts_status st = {0};
    ev_set set;
    char path[400], spec[320], peers[300];
    ev_contact contact = {0};
    float *image;
    double fov;
    CHECK(io_material_create(&m, 32, &st) == TS_OK, "%s", st.message);
    io_procedural_make(&p, 2, &m);
    io_image photo;
    CHECK(io_image_create(&photo, 40, 32, 3, &st) == TS_OK, "%s", st.message);
    for (int i = 0; i < 32 * 40 * 3; i++) photo.data[i] = 0.25f;
    snprintf(path, sizeof path, "%s/photos", test_folder());
    snprintf(peers, sizeof peers, "%s/peers", test_folder());
    CHECK(mkdir(path, 0777) == 0 && mkdir(peers, 0777) == 0, "%s", path);
    for (int i = 0; i < 10; i++) {
        snprintf(path, sizeof path, "%s/photos/%d.png", test_folder(), i);
        CHECK(io_write_png(path, &photo, 8, true, &st) == TS_OK, "%s", st.message);
    }
    snprintf(path, sizeof path, "%s/1.png", peers);
    write_sheet(path, &m, false);
    snprintf(spec, sizeof spec, "photos:%s/photos", test_folder());
    CHECK(ev_set_open(spec, NULL, &set, &st) == TS_OK && set.count == 10, "%s", st.message);
    set.peers = peers;
    for (int i = 0; i < 10; i++) {
        CHECK(ev_set_load_photo(&set, i, 32, &image, &fov, &truth, &peer, &st) == TS_OK, "%s", st.message);
        CHECK(truth.size == 0 && peer.size == (i == 1 ? 32 : 0) && truth.name[0] == '0' + i, "%d: %s", i, truth.name);
        CHECK(fabsf(image[0] - 0.25f) < 2e-3f, "a value is %g", (double)image[0]);
        ev_case c = ev_case_of_photo(image, 32);
        if (peer.size) c.peer = &peer;
        const ev_row row = ev_score(&c, m.maps, MAP_CHANNELS);
        CHECK(row.value[EV_RELIEF] > 0 && isnan(row.value[EV_RENDER]) && isnan(row.value[EV_NORMAL]), "relief %g",
              row.value[EV_RELIEF]);
        CHECK(ev_contact_add(&contact, &c, m.maps, &st) == TS_OK, "%s", st.message);
        free(image);
    }
    /* eleven rows of six panels in two columns */
    io_image sheet;
    snprintf(path, sizeof path, "%s/contact.png", test_folder());
    CHECK(ev_contact_write(&contact, path, &st) == TS_OK &&
              io_read_photo(path, IO_MAX_PIXELS_DEFAULT, &sheet, &st) == TS_OK,
          "%s", st.message);
    CHECK(sheet.width == 2 * 6 * 32 && sheet.height == 6 * 32, "%d x %d", sheet.width, sheet.height);
    io_image_free(&sheet);
    io_image_free(&photo);
    ev_contact_free(&contact);
    ev_set_close(&set);
    io_material_free(&m);
    io_material_free(&truth);
    io_material_free(&peer);
}

TEST(eval_the_factor_of_a_brighter_picture)
{
    float a[300], b[300];
    for (int i = 0; i < 300; i++) a[i] = (float)i / 300, b[i] = fminf(1.7f * a[i], 1);
    b[299] = 1.5f; /* clipped: counts for nothing */
    CHECK(fabs(ev_factor(170, a, b) - 1.7) < 1e-4, "factor %g", ev_factor(170, a, b));
    CHECK(ev_factor(1, a, b) == 1, "black has a factor");
}

TEST(eval_the_nearest_picture_comes_first)
{
    io_capture c;
    ts_status st = {0};
    CHECK(io_capture_create(&c, 4, 2, &st) == TS_OK, "%s", st.message);
    for (int i = 0; i < 4; i++) {
        for (int k = 0; k < 12; k++) c.image[i * 12 + k] = (float)(100 * i + k);
        c.camera[i][0] = i == 2 ? 0.1f : 1, c.camera[i][1] = (float)i, c.camera[i][2] = 2;
        c.light[i][0] = (float)i;
    }
    c.camera[2][1] = 0;
    ev_capture_nearest_first(&c);
    static const int order[] = {2, 0, 1, 3};
    for (int i = 0; i < 4; i++) {
        CHECK(c.light[i][0] == (float)order[i] && c.image[i * 12 + 5] == (float)(100 * order[i] + 5), "picture %d", i);
        CHECK(c.camera[i][1] == (order[i] == 2 ? 0 : (float)order[i]), "camera %d", i);
    }
    const ev_case untold = ev_case_of_capture(&c, c.image, 1, false, false);
    const rd_view flash = rd_flash();
    CHECK(memcmp(&untold.view, &flash, sizeof flash) == 0, "the method is given a camera");
    CHECK(fabs(untold.fov - rd_fov_of(hypot(0.1, 2))) < 1e-6, "a field of view of %g degrees", untold.fov);
    io_capture_free(&c);
}
