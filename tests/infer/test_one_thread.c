/* An estimate on one thread starts no others. */
#include "tensor/threads.h"
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
