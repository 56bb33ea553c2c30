/* The public C API's files: photographs and masks in, maps out. */
#include "data/material.h"
#include "infer/meta.h"
#include "infer/output.h"
#include "tests/support/files.h"
#include "tests/support/inference.h"
#include <sys/stat.h>
#include <unistd.h>

enum { W = 40, H = 30, CUT = 16 };

static const char *in_folder(const char *name)
{
    static char path[2][300];
    static int next;
    next = !next;
    snprintf(path[next], sizeof path[next], "%s/%s", test_folder(), name);
    return path[next];
}

/* The levels of 8 bits of a picture, and the picture as a file. */
static const char *make_photo(unsigned char levels[W * H * 3])
{
    io_image image;
    ts_status st = {0};
    ts_rng rng = ts_rng_make(3, TS_STREAM_TEST, 0);
    CHECK(io_image_create(&image, W, H, 3, &st) == TS_OK, "%s", st.message);
    for (int i = 0; i < W * H * 3; i++) {
        levels[i] = (unsigned char)(255 * ts_rng_uniform(&rng));
        image.data[i] = (float)levels[i] / 255;
    }
    const char *path = in_folder("photo.png");
    CHECK(io_write_png(path, &image, 8, false, &st) == TS_OK, "%s", st.message);
    io_image_free(&image);
    return path;
}

static double most_apart(const float *a, const float *b, int count)
{
    double most = 0;
    for (int i = 0; i < count; i++) most = farther(most, fabs((double)a[i] - b[i]));
    return most;
}

TEST(infer_a_photograph_in_memory_is_that_of_its_file)
{
    static unsigned char levels[W * H * 3];
    static unsigned short fine[W * H * 3];
    static float values[W * H * 3], from_file[CUT * CUT * 3], from_memory[CUT * CUT * 3];
    lgd_error e;
    lgd_facts facts = {.size = sizeof facts, .width = -1, .fov = -1, .profile = "unset"};
    const char *path = make_photo(levels);
    CHECK(!lgd_read_photo(path, CUT, NULL, from_file, &facts, &e) && !e.code, "%s", e.message);
    CHECK(facts.width == W && facts.height == H && facts.fov == LGD_FOV_UNKNOWN && *facts.fov_from && !*facts.profile,
          "%d x %d, %g (%s), '%s'", facts.width, facts.height, facts.fov, facts.fov_from, facts.profile);
    for (int i = 0; i < W * H * 3; i++) {
        fine[i] = (unsigned short)(levels[i] * 257);
        values[i] = io_srgb_to_linear((float)levels[i] / 255);
    }
    const void *pixels[] = {levels, fine, values};
    static const int encoding[] = {LGD_SRGB8, LGD_SRGB16, LGD_LINEAR};
    for (int k = 0; k < 3; k++) {
        memset(from_memory, 0, sizeof from_memory);
        CHECK(!lgd_square(pixels[k], encoding[k], W, H, CUT, from_memory, &e), "%s", e.message);
        const double apart = most_apart(from_file, from_memory, CUT * CUT * 3);
        CHECK(apart < 1e-6, "encoding %d: %g apart", k, apart);
    }
    values[W * (H / 2) * 3 + 3 * W / 2] = NAN;
    values[W * (H / 2) * 3 + 3 * W / 2 + 1] = INFINITY;
    CHECK(!lgd_square(values, LGD_LINEAR, W, H, CUT, from_memory, &e), "%s", e.message);
    for (int i = 0; i < CUT * CUT * 3; i++) CHECK(isfinite(from_memory[i]), "a value spreads");
}

TEST(infer_says_what_is_transparent)
{
    static float image[CUT * CUT * 3];
    lgd_error e;
    ts_status st = {0};
    for (int holes = 0; holes < 2; holes++) {
        lgd_facts facts = {.size = sizeof facts};
        io_image with_alpha;
        char path[512];
        CHECK(!io_image_create(&with_alpha, W, H, 4, &st), "%s", st.message);
        for (int i = 0; i < W * H * 4; i++) with_alpha.data[i] = i % 4 == 3 ? 1 : 0.25f;
        if (holes) with_alpha.data[W * H * 4 - 1] = 0.5f;
        snprintf(path, sizeof path, "%s/alpha.png", test_folder());
        CHECK(!io_write_png(path, &with_alpha, 8, true, &st), "%s", st.message);
        CHECK(!lgd_read_photo(path, CUT, NULL, image, &facts, &e) && facts.transparent == holes, "%d: %d, %s", holes,
              facts.transparent, e.message);
        CHECK(fabsf(image[0] - 0.25f) < 0.01f, "what is opaque is %g", (double)image[0]);
        io_image_free(&with_alpha);
    }
}

/* A caller that was compiled with fewer facts keeps what stands behind them, one with more gets zeros. */
TEST(infer_facts_grow)
{
    static unsigned char levels[W * H * 3];
    static float image[CUT * CUT * 3];
    lgd_error e;
    lgd_facts facts = {.size = offsetof(lgd_facts, fov), .fov = 7};
    CHECK(!lgd_read_photo(make_photo(levels), CUT, NULL, image, &facts, &e) && facts.width == W && facts.fov == 7, "%s",
          e.message);
    struct {
        lgd_facts known;
        char more[40], behind;
    } later = {.known = {.size = offsetof(__typeof__(later), behind)}, .more = {1, [39] = 1}, .behind = 1};
    CHECK(!lgd_read_photo(in_folder("photo.png"), CUT, NULL, image, &later.known, &e) && later.known.height == H, "%s",
          e.message);
    CHECK(later.known.size == sizeof facts + 40 && !later.more[0] && !later.more[39] && later.behind == 1,
          "size %zu, what the library does not know is %d and %d, behind it is %d", later.known.size, later.more[0],
          later.more[39], later.behind);
    facts.size = 5000;
    CHECK(lgd_read_photo(in_folder("photo.png"), CUT, NULL, image, &facts, &e) && strstr(e.message, "facts.size"),
          "taken: %s", e.message);
}

TEST(infer_reading_says_what_is_wrong)
{
    static unsigned char levels[W * H * 3], mask[CUT * CUT];
    static float image[CUT * CUT * 3];
    lgd_error e;
    const char *path = make_photo(levels);
    CHECK(lgd_read_photo(in_folder("absent.jpg"), CUT, NULL, image, NULL, &e) && strstr(e.message, "absent.jpg"),
          "an absent file: %s", e.message);
    CHECK(lgd_read_photo(path, 0, NULL, image, NULL, &e) == TS_INVALID && strstr(e.message, "side is 0"), "%s",
          e.message);
    CHECK(lgd_read_photo(NULL, CUT, NULL, image, NULL, &e) == TS_INVALID, "no path");
    const lgd_read_options few = {.size = sizeof few, .max_pixels = W * H - 1},
                           enough = {.size = sizeof enough, .max_pixels = W * H},
                           odd = {.size = sizeof odd, .threads = -1}, none = {0};
    CHECK(lgd_read_photo(path, CUT, &few, image, NULL, &e) && strstr(e.message, path), "max_pixels: %s", e.message);
    CHECK(!lgd_read_photo(path, CUT, &enough, image, NULL, &e), "max_pixels: %s", e.message);
    CHECK(lgd_read_photo(path, CUT, &odd, image, NULL, &e) && strstr(e.message, "threads"), "%s", e.message);
    CHECK(lgd_read_photo(path, CUT, &none, image, NULL, &e) && strstr(e.message, "size is 0"), "%s", e.message);
    CHECK(!lgd_read_mask(path, CUT, W, H, NULL, mask, &e) && !lgd_read_mask(path, CUT, 0, 0, NULL, mask, &e), "%s",
          e.message);
    CHECK(lgd_read_mask(path, CUT, H, W, NULL, mask, &e) == TS_INVALID && strstr(e.message, "same shape"), "%s",
          e.message);
    CHECK(lgd_square(levels, 3, W, H, CUT, image, &e) && strstr(e.message, "encoding is 3"), "%s", e.message);
    CHECK(lgd_square(levels, LGD_SRGB8, 0, H, CUT, image, &e) && strstr(e.message, "0 x 30"), "%s", e.message);
}

TEST(infer_find_weights)
{
    char path[4096];
    lgd_error e;
    setenv("LGD_MODEL", "/a/b.safetensors", 1);
    CHECK(!lgd_find_weights(NULL, path, sizeof path, &e) && !strcmp(path, "/a/b.safetensors"), "%s", e.message);
    CHECK(!lgd_find_weights("c.safetensors", path, sizeof path, &e) && !strcmp(path, "c.safetensors"), "%s", e.message);
    CHECK(lgd_find_weights("", path, sizeof path, &e) == TS_INVALID && strstr(e.message, "empty"), "%s", e.message);
    CHECK(!lgd_find_weights("d.pth", path, (size_t)1 << 32, &e) && !strcmp(path, "d.pth"), "%s", e.message);
    CHECK(lgd_find_weights(NULL, path, 5, &e) == TS_INVALID && strstr(e.message, "5 bytes"), "%s", e.message);
    CHECK(lgd_find_weights("no-such-model", path, sizeof path, &e) == TS_IO && strstr(e.message, "no-such-model"), "%s",
          e.message);
}

static void make_maps(float maps[VALUES])
{
    ts_rng rng = ts_rng_make(4, TS_STREAM_TEST, 0);
    for (int i = 0; i < VALUES; i++) {
        const int c = i % MAP_CHANNELS;
        maps[i] = c == MAP_NORMAL || c == MAP_NORMAL + 1 ? ts_rng_range(&rng, -0.6f, 0.6f) : ts_rng_uniform(&rng);
    }
}

static bool there(const char *folder, const char *name)
{
    char path[600];
    snprintf(path, sizeof path, "%s/%s", folder, name);
    return access(path, F_OK) == 0;
}

TEST(infer_maps_are_written_and_read_back)
{
    static float maps[VALUES], image[SIDE * SIDE * 3];
    io_material back = {0};
    ts_status st = {0};
    lgd_error e;
    char path[600];
    make_maps(maps);
    make_image(image, SIDE);
    const char *folder = in_folder("wall///");
    const lgd_photo photo = lgd_flash_photo(image);
    CHECK(!lgd_write_maps(folder, maps, SIDE, &photo, NULL, &e) && !e.code, "%s", e.message);
    for (int k = 0; k < LGD_FILES; k++) {
        const bool wanted = k == LGD_FILES - 1 || LGD_OUT_DEFAULT >> k & 1;
        CHECK(there(folder, lgd_files[k]) == wanted, "%s is %s", lgd_files[k], wanted ? "absent" : "there");
    }
    snprintf(path, sizeof path, "%s/maps.exr", folder);
    CHECK(io_read_maps_exr(path, &back, &st) == TS_OK && back.size == SIDE, "%s", st.message);
    for (int i = 0; i < VALUES; i++) { /* maps.exr has them as lgd.h does; they are read to [-1, 1] */
        const int c = i % MAP_CHANNELS;
        const bool normal = c == MAP_NORMAL || c == MAP_NORMAL + 1;
        const double want = normal ? maps[i] : 2 * (double)maps[i] - 1;
        CHECK(fabs(back.maps[i] - want) < 1e-6, "value %d is %g, not %g", i, (double)back.maps[i], want);
    }
    io_material_free(&back);
    /* without the photograph, other maps: what was there for the first goes */
    maps[0] = 0.5f;
    CHECK(!lgd_write_maps(folder, maps, SIDE, NULL, NULL, &e), "%s", e.message);
    CHECK(there(folder, "preview.png") && !there(folder, "render.png"), "render.png is of other maps");
    /* a name without a folder is one of the working folder */
    CHECK(chdir(test_folder()) == 0, "set-up");
    const lgd_write_options few = {.size = sizeof few, .maps = "normal,height", .directx = 1, .fov_from = "a test"};
    CHECK(!lgd_write_maps("here", maps, SIDE, NULL, &few, &e), "%s", e.message);
    CHECK(there(in_folder("here"), "height.png") && !there(in_folder("here"), "maps.exr"), "other files");
}

static bool meta_says(const char *folder, const char *text)
{
    char *meta = lgd_meta_read(folder);
    const bool says = meta && strstr(meta, text);
    free(meta);
    return says;
}

TEST(infer_meta_says_how_the_field_of_view_is_known)
{
    static float maps[VALUES];
    lgd_error e;
    make_maps(maps);
    lgd_photo photo = lgd_flash_photo(NULL);
    lgd_write_options o = {.size = sizeof o, .maps = "normal"};
    const char *folder = in_folder("wall");
    CHECK(!lgd_write_maps(folder, maps, SIDE, &photo, &o, &e) && meta_says(folder, "(given)"), "%s", e.message);
    o.fov_from = "no EXIF", o.fov_unknown = 1;
    CHECK(!lgd_write_maps(folder, maps, SIDE, &photo, &o, &e) && meta_says(folder, "(assumed: no EXIF)"), "%s",
          e.message);
    photo.camera[2] = photo.light[2] = 1.5f;
    CHECK(!lgd_write_maps(folder, maps, SIDE, &photo, &o, &e) && meta_says(folder, "(estimated: no EXIF)"), "%s",
          e.message);
    o.size = offsetof(lgd_write_options, fov_unknown); /* a caller that was compiled without it */
    CHECK(!lgd_write_maps(folder, maps, SIDE, &photo, &o, &e) && meta_says(folder, "(no EXIF)"), "%s", e.message);
}

/* What meta.txt names is ours: of the same maps it stays and keeps its line, of others it goes. The rest is not. */
TEST(infer_writing_keeps_what_is_not_its_own)
{
    static float maps[VALUES];
    lgd_error e;
    make_maps(maps);
    const char *folder = path_of("wall"), *theirs = path_of("wall/preview.png");
    CHECK(mkdir(folder, 0777) == 0, "set-up");
    spill(theirs, "theirs", 6);
    const lgd_write_options height = {.size = sizeof height, .maps = "height,diffuse"},
                            normal = {.size = sizeof normal, .maps = "normal"};
    CHECK(!lgd_write_maps(folder, maps, SIDE, NULL, &height, &e), "%s", e.message);
    CHECK(there(folder, "preview.png"), "a file that no meta.txt names is gone");
    CHECK(!lgd_write_maps(folder, maps, SIDE, NULL, &normal, &e), "%s", e.message);
    CHECK(there(folder, "height.png") && meta_says(folder, "\nheight.png: linear, 16 bit: height, value v is "),
          "of the same maps height.png stays, with its scale");
    CHECK(meta_says(folder, "\ndiffuse: sRGB\n") && meta_says(folder, "\nnormal.png: "), "lines are lost");
    maps[0] = 0.5f;
    CHECK(!lgd_write_maps(folder, maps, SIDE, NULL, &normal, &e), "%s", e.message);
    CHECK(!there(folder, "height.png") && !there(folder, "diffuse.png"), "of other maps a file stays");
    CHECK(!meta_says(folder, "height.png") && !meta_says(folder, "diffuse"), "of other maps a line stays");
    CHECK(there(folder, "preview.png"), "a file that no meta.txt names is gone");
    /* a process that was killed while it moved its files: what it named goes as well */
    ts_status st = {0};
    CHECK(lgd_write_meta_begun(path_of("wall/meta.txt"), LGD_OUT_NORMAL | LGD_OUT_PREVIEW, &st) == TS_OK, "%s",
          st.message);
    CHECK(!lgd_write_maps(folder, maps, SIDE, NULL, &height, &e), "%s", e.message);
    CHECK(there(folder, "height.png") && !there(folder, "normal.png") && !there(folder, "preview.png"),
          "what a killed process left is kept");
}

TEST(infer_writing_says_what_is_wrong)
{
    static float maps[VALUES];
    lgd_error e;
    make_maps(maps);
    const struct {
        const char *folder, *says;
        int side;
        lgd_write_options o;
    } wrong[] = {{"x", "'colour' is nothing", SIDE, {.maps = "colour"}},
                 {"x", "render and page", SIDE, {.maps = "diffuse,render"}},
                 {"x", "OpenGL", SIDE, {.maps = "glb", .directx = 1}},
                 {"x", "MaterialX", SIDE, {.maps = "materialx", .metallic = 1}},
                 {"x", "exr is 3", SIDE, {.exr = 3}},
                 {"x", "threads is 5000", SIDE, {.threads = 5000}},
                 {"x", "side is 0", 0, {.maps = NULL}},
                 {"x", "seamless", 8, {.seamless = 1}},
                 {"x/..", "no name of a folder", SIDE, {.maps = NULL}},
                 {"", "no name of a folder", SIDE, {.maps = NULL}},
                 {"absent/x", "absent", SIDE, {.maps = NULL}}};
    CHECK(chdir(test_folder()) == 0, "set-up");
    for (size_t k = 0; k < sizeof wrong / sizeof *wrong; k++) {
        lgd_write_options o = wrong[k].o;
        o.size = sizeof o;
        CHECK(lgd_write_maps(wrong[k].folder, maps, wrong[k].side, NULL, &o, &e) && strstr(e.message, wrong[k].says),
              "%zu: '%s' has no '%s'", k, e.message, wrong[k].says);
    }
    CHECK(lgd_write_maps("x", NULL, SIDE, NULL, NULL, NULL) == TS_INVALID, "no maps");
    const lgd_write_options lines = {.size = sizeof lines, .fov_from = "a lens\nworkflow: metallic"};
    CHECK(lgd_write_maps("x", maps, SIDE, NULL, &lines, &e) && strstr(e.message, "fov_from must be one line"), "%s",
          e.message);
    for (int k = 0; k < 4; k++) {
        lgd_photo photo = lgd_flash_photo(NULL);
        float *values[] = {&photo.camera[2], &photo.camera[2], &photo.light[0], &photo.power};
        *values[k] = (float[]){-1, NAN, INFINITY, 0}[k];
        CHECK(lgd_write_maps("x", maps, SIDE, &photo, NULL, &e) && strstr(e.message, "must be above the sample"), "%s",
              e.message);
    }
    maps[VALUES - 1] = NAN;
    CHECK(lgd_write_maps("x", maps, SIDE, NULL, NULL, &e) == TS_NUMERIC && strstr(e.message, "must be finite"), "%s",
          e.message);
    CHECK(!there(test_folder(), "x") && !there(test_folder(), "absent"), "something is left");
}
