/* What lgd-infer settles before its work (options, names, weights), and how it writes files. */
#include "cli/infer/options.h"
#include "cli/infer/plan.h"
#include "data/material.h"
#include "infer/model_path.h"
#include "infer/output.h"
#include "infer/preview.h"
#include "tensor/rng.h"
#include "tests/support/files.h"
#include "tests/test.h"
#include <getopt.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

static void expect_stem(const char *photo, const char *stem)
{
    cl_plan p;
    ts_status st = {0};
    char *photos[] = {(char *)photo}, folder[256];
    const ts_code code = cl_plan_make(photos, 1, "OUT", &p, &st);
    if (!stem) {
        CHECK(code == TS_INVALID && st.message[0], "'%s' is taken", photo);
        return;
    }
    CHECK(code == TS_OK, "%s", st.message);
    snprintf(folder, sizeof folder, "OUT/%s", stem);
    CHECK(strcmp(p.job[0].stem, stem) == 0 && strcmp(p.job[0].folder, folder) == 0, "'%s' goes to %s", photo,
          p.job[0].folder);
    cl_plan_free(&p);
}

TEST(infer_stems)
{
    expect_stem("a/b/wall.jpg", "wall");
    expect_stem("wall", "wall");
    expect_stem("wall.tar.gz", "wall.tar");
    expect_stem("a.b/wall", "wall");
    expect_stem("a b/ö ü.png", "ö ü");
    expect_stem(".hidden", ".hidden");
    expect_stem("..jpg", "..jpg");
    expect_stem("...jpg", "...jpg");
    expect_stem("....jpg", "...");
    expect_stem("-.png", "-");
    CHECK(mkdir(path_of("wood.v1"), 0777) == 0 && chdir(path_of("wood.v1")) == 0, "set-up");
    expect_stem(".", "wood.v1");
    expect_stem("../wood.v1", "wood.v1");
    expect_stem("../wood.v1/", "wood.v1");
    expect_stem("/", NULL);
    expect_stem("a/..", NULL);
    expect_stem("a/", NULL);
    expect_stem("", NULL);
}

TEST(infer_same_stem_is_refused_with_both_names)
{
    char *photos[] = {"x/wall.jpg", "floor.png", "y/wall.png"};
    cl_plan p;
    ts_status st = {0};
    CHECK(cl_plan_make(photos, 3, "OUT", &p, &st) == TS_INVALID, "taken");
    CHECK(strstr(st.message, "x/wall.jpg") && strstr(st.message, "y/wall.png") && !strstr(st.message, "floor"), "%s",
          st.message);
    CHECK(cl_plan_make(photos, 2, "OUT", &p, &st) == TS_OK, "two stems: %s", st.message);
    cl_plan_free(&p);
}

TEST(infer_a_photograph_is_never_replaced)
{
    char folder[200], photo[256], linked[256], out[256];
    snprintf(folder, sizeof folder, "%s/diffuse", test_folder());
    snprintf(photo, sizeof photo, "%s/diffuse.png", folder);
    snprintf(linked, sizeof linked, "%s/link", test_folder());
    snprintf(out, sizeof out, "%s/link/..", test_folder());
    CHECK(mkdir(folder, 0777) == 0 && symlink("diffuse", linked) == 0, "set-up");
    spill(photo, "old", 3);
    char *photos[] = {photo};
    cl_plan p;
    ts_status st = {0};
    CHECK(cl_plan_make(photos, 1, test_folder(), &p, &st) == TS_INVALID && strstr(st.message, photo), "taken: %s",
          st.message);
    CHECK(cl_plan_make(photos, 1, out, &p, &st) == TS_INVALID, "taken through a link");
    CHECK(cl_plan_make(photos, 1, folder, &p, &st) == TS_OK, "its own folder is fine: %s", st.message);
    cl_plan_free(&p);
    snprintf(photo, sizeof photo, "%s/noextension", test_folder());
    spill(photo, "old", 3);
    CHECK(cl_plan_make(photos, 1, test_folder(), &p, &st) == TS_INVALID, "a file would become a folder");
}

static const lgd_order everything = {.which = (1u << LGD_OUTPUTS) - 1, .threads = 2, .fov_from = "a test"};

static void make_material(io_material *m, io_image *photo, int size)
{
    ts_status st = {0};
    CHECK(io_material_create(m, size, &st) == TS_OK && io_image_create(photo, size, size, 3, &st) == TS_OK, "%s",
          st.message);
    ts_rng rng = ts_rng_make(5, TS_STREAM_TEST, 0);
    for (int i = 0; i < size * size * MAP_CHANNELS; i++) m->maps[i] = ts_rng_range(&rng, -0.6f, 0.6f);
    for (int i = 0; i < size * size * 3; i++) photo->data[i] = ts_rng_uniform(&rng);
}

static int count_entries(const char *folder)
{
    char command[400];
    int n = -1;
    snprintf(command, sizeof command, "ls -A '%s' | wc -l", folder);
    FILE *f = popen(command, "r");
    CHECK(f && fscanf(f, "%d", &n) == 1, "cannot list %s", folder);
    pclose(f);
    return n;
}

TEST(infer_output_is_complete_and_replaces)
{
    enum { SIZE = 8 };
    io_material m = {0}, back = {0};
    io_image photo = {0}, picture = {0};
    ts_status st = {0};
    char path[300];
    make_material(&m, &photo, SIZE);
    for (int round = 0; round < 2; round++) {
        const lgd_photo flash = lgd_flash_photo(photo.data);
        CHECK(lgd_output_write(test_folder(), "x", &m, &flash, &everything, NULL, &st) == TS_OK, "round %d: %s", round,
              st.message);
        snprintf(path, sizeof path, "%s/x", test_folder());
        CHECK(count_entries(path) == LGD_FILES && count_entries(test_folder()) == 1, "round %d: %d files", round,
              count_entries(path));
        m.maps[MAP_ROUGHNESS] = -0.25f; /* in the second round */
    }
    snprintf(path, sizeof path, "%s/x/maps.exr", test_folder());
    CHECK(io_read_maps_exr(path, &back, &st) == TS_OK && back.size == SIZE, "%s", st.message);
    CHECK(fabsf(back.maps[MAP_ROUGHNESS] + 0.25f) < 1e-6f, "the old file is still there");
    snprintf(path, sizeof path, "%s/x/render.png", test_folder());
    CHECK(io_read_photo(path, 1 << 20, &picture, &st) == TS_OK && picture.width == 2 * SIZE && picture.height == SIZE,
          "%s", st.message);
    for (int i = 0; i < SIZE * 3; i++)
        CHECK(fabsf(picture.data[i] - photo.data[i]) < 0.01f, "the left half is not the photograph");
    io_image_free(&picture);
    snprintf(path, sizeof path, "%s/x/preview.png", test_folder());
    CHECK(io_read_photo(path, 1 << 20, &picture, &st) == TS_OK && picture.width == LGD_PREVIEW_LIGHTS * SIZE &&
              picture.height == SIZE,
          "%s", st.message);
    io_image_free(&picture);
    io_image_free(&photo);
    io_material_free(&m);
    io_material_free(&back);
}

TEST(infer_output_failure_leaves_nothing)
{
    io_material m = {0};
    io_image photo = {0};
    ts_status st = {0};
    char path[300];
    make_material(&m, &photo, 4);
    snprintf(path, sizeof path, "%s/x", test_folder());
    spill(path, "old", 3);
    const lgd_photo flash = lgd_flash_photo(photo.data);
    CHECK(lgd_output_write(test_folder(), "x", &m, &flash, &everything, NULL, &st) == TS_IO && strstr(st.message, "/x"),
          "a file in the way: %s", st.message);
    CHECK(count_entries(test_folder()) == 1, "something is left");
    st = (ts_status){0};
    CHECK(lgd_output_check(path, &st) == TS_IO && strstr(st.message, path), "a file is taken as a folder: %s",
          st.message);
    st = (ts_status){0};
    CHECK(lgd_output_check(test_folder(), &st) == TS_OK && count_entries(test_folder()) == 1, "%s", st.message);
    io_image_free(&photo);
    io_material_free(&m);
}

static ts_code parse(cl_command *c, ts_status *st, const char *a, const char *b, const char *d)
{
    static char program[] = "lgd-infer";
    char *argv[] = {program, (char *)a, (char *)b, (char *)d, NULL};
    int argc = 1;
    while (argv[argc]) argc++;
    *st = (ts_status){0};
    optind = 0; /* glibc: start anew */
    return cl_command_parse(argc, argv, c, st);
}

TEST(infer_command_line)
{
    cl_command c;
    ts_status st;
    CHECK(parse(&c, &st, "p.jpg", "-oOUT", "--size=17") == TS_OK && c.size == 17 && c.photos == 1 &&
              strcmp(c.out, "OUT") == 0,
          "%s", st.message);
    CHECK(strcmp(c.photo[0], "p.jpg") == 0 && c.iterations == -1 && !c.directx && c.threads == 0, "defaults");
    CHECK(parse(&c, &st, "--output=OUT", "--", "-x.jpg") == TS_OK && strcmp(c.photo[0], "-x.jpg") == 0, "%s",
          st.message);
    CHECK(parse(&c, &st, "-oOUT", "--normal=dx", "p") == TS_OK && c.directx, "%s", st.message);
    CHECK(parse(&c, &st, "--help", "--nonsense", NULL) == TS_OK && c.help, "%s", st.message);
    static const char *const wrong[][2] = {{"--size=0", "--size"},
                                           {"--size=1e3", "--size"},
                                           {"--size=-1", "--size"},
                                           {"--size= 8", "--size"},
                                           {"--size", "--size needs"},
                                           {"--size=99999999999999999999", "--size"},
                                           {"--iterations=-1", "--iterations"},
                                           {"--iterations=2,5", "--iterations"},
                                           {"--threads=x", "--threads"},
                                           {"--normal=up", "--normal"},
                                           {"--max-pixels=0", "--max-pixels"},
                                           {"--nonsense", "--nonsense"},
                                           {"-z", "-z"},
                                           {"-o", "-o needs"},
                                           {"--quiet=3", "--quiet"}};
    for (size_t i = 0; i < sizeof wrong / sizeof *wrong; i++)
        CHECK(parse(&c, &st, "p.jpg", "-oOUT", wrong[i][0]) == TS_INVALID && strstr(st.message, wrong[i][1]),
              "%s: '%s'", wrong[i][0], st.message);
    CHECK(parse(&c, &st, "-oOUT", NULL, NULL) == TS_INVALID && strstr(st.message, "photograph"), "%s", st.message);
    CHECK(parse(&c, &st, "p.jpg", NULL, NULL) == TS_INVALID && strstr(st.message, "-o"), "%s", st.message);
    CHECK(parse(&c, &st, "p.jpg", "-o", "") == TS_INVALID, "an empty folder name");
}

TEST(infer_model_path_order)
{
    char path[LGD_PATH_MAX];
    ts_status st = {0};
    CHECK(setenv("LGD_MODEL", "/from/variable", 1) == 0, "setenv");
    CHECK(lgd_model_path("given.safetensors", "single", path, &st) == TS_OK && strcmp(path, "given.safetensors") == 0,
          "%s", path);
    CHECK(lgd_model_path("./given", "single", path, &st) == TS_OK && strcmp(path, "./given") == 0, "%s", path);
    CHECK(lgd_model_path("given", "single", path, &st) == TS_IO && strstr(st.message, "no given.safetensors"),
          "a name that no model has: %s", st.message);
    st = (ts_status){0};
    CHECK(lgd_model_path("phone", "single", path, &st) == TS_OK && strstr(path, "/phone.safetensors"), "%s: %s", path,
          st.message);
    CHECK(lgd_model_path(NULL, "single", path, &st) == TS_OK && strcmp(path, "/from/variable") == 0, "%s", path);
}
