/* An estimate on one thread starts no others. */
#include "data/image/image.h"
#include "infer/page.h"
#include "tensor/threads.h"
#include "tests/support/files.h"
#include "tests/support/inference.h"
#include <dirent.h>

static int threads_of_this_process(void)
{
    DIR *d = opendir("/proc/self/task");
    int count = 0;
    if (!d) test_skip("there is no /proc/self/task");
    for (const struct dirent *e; (e = readdir(d));) count += e->d_name[0] != '.';
    closedir(d);
    return count;
}

TEST(infer_on_one_thread_starts_no_other)
{
    enum { LARGE = 256 };
    float *image = malloc(sizeof(float) * LARGE * LARGE * 3),
          *maps = malloc(sizeof(float) * LARGE * LARGE * MAP_CHANNELS);
    ts_threads_set(1); /* weights are read on all */
    lgd_model *m = load(tiny());
    lgd_error e;
    lgd_options o;
    ts_threads_set(2);
    make_image(image, LARGE);
    lgd_options_init(&o, sizeof o);
    o.threads = 1;
    CHECK(lgd_estimate(m, image, LARGE, &o, maps, &e) == 0, "%s", e.message);
    CHECK(threads_of_this_process() == 1, "%d threads", threads_of_this_process());
    o.threads = 2;
    CHECK(lgd_estimate(m, image, LARGE, &o, maps, &e) == 0, "%s", e.message);
    CHECK(threads_of_this_process() > 1, "two threads were asked for");
    lgd_free(&m);
    free(image);
    free(maps);
}

/* Files too: a photograph and a mask that are resampled, a page that shows fewer pixels than there are. */
TEST(infer_files_on_one_thread_start_no_other)
{
    enum { FILE_SIDE = 700, LARGE = LGD_PAGE_MOST + 100 };
    const size_t pixels = (size_t)LARGE * LARGE;
    float *image = malloc(pixels * 3 * sizeof *image), *maps = malloc(pixels * MAP_CHANNELS * sizeof *maps);
    unsigned char *mask = malloc(pixels);
    ts_status st = {0};
    lgd_error e;
    ts_threads_set(2);
    make_image(image, FILE_SIDE);
    const char *photo = path_of("photo.png");
    CHECK(io_write_png(photo, &(io_image){FILE_SIDE, FILE_SIDE, 3, image}, 8, true, &st) == TS_OK, "%s", st.message);
    for (int published = 0; published < 2; published++) {
        const lgd_read_options o = {.size = sizeof o, .published = published, .threads = 1};
        CHECK(lgd_read_photo(photo, LARGE, &o, image, NULL, &e) == 0, "%s", e.message);
        CHECK(lgd_read_mask(photo, LARGE, 0, 0, &o, mask, &e) == 0, "%s", e.message);
        CHECK(threads_of_this_process() == 1, "%d threads", threads_of_this_process());
    }
    for (size_t i = 0; i < pixels * MAP_CHANNELS; i++) maps[i] = 0.25f;
    lgd_photo flash = lgd_flash_photo(image);
    const lgd_write_options o = {.size = sizeof o, .maps = "page,preview,render,normal", .threads = 1};
    CHECK(lgd_write_maps(path_of("out"), maps, LARGE, &flash, &o, &e) == 0, "%s", e.message);
    CHECK(threads_of_this_process() == 1, "%d threads", threads_of_this_process());
    free(image);
    free(maps);
    free(mask);
}
