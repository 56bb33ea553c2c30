/* Weights in halves, which stay in their file until they are packed. */
#include "nn/weights/weights.h"
#include "tests/support/files.h"
#include "tests/support/inference.h"
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

enum { MOST = 128 };

/* The file from, with tensors of that type, one of whose first numbers is replaced where a name is given. */
static void write_as(const char *from, const char *to, nn_dtype type, const char *name, uint16_t number)
{
    ts_status st = {0};
    nn_file *f = nn_file_open(from, &st);
    CHECK(f, "%s", st.message);
    const int count = nn_file_count(f);
    nn_tensor tensor[MOST];
    nn_meta meta[NN_ARCH_META];
    int metas = 0;
    unsigned char *changed = NULL;
    CHECK(count <= MOST, "%d tensors", count);
    for (int i = 0; i < count; i++) {
        tensor[i] = *nn_file_tensor(f, i);
        if (!name || strcmp(tensor[i].name, name) != 0) continue;
        const size_t bytes = (size_t)tensor[i].count * 2;
        changed = malloc(bytes);
        memcpy(changed, tensor[i].data, bytes);
        memcpy(changed + 2, &number, 2);
        tensor[i].data = changed;
    }
    CHECK(!name || changed, "no %s", name);
    for (const char *key; (key = nn_file_meta_key(f, metas)); metas++)
        meta[metas] = (nn_meta){key, nn_file_meta(f, key)};
    CHECK(!nn_file_write(to, NN_FORM_SAFETENSORS, tensor, count, type, meta, metas, NULL, &st), "%s", st.message);
    free(changed);
    nn_file_close(&f);
}

static void maps_of(const char *path, const float *image, float *maps)
{
    lgd_error e;
    lgd_model *m = lgd_load(path, &e);
    CHECK(m, "%s", e.message);
    unlink(path); /* as when it is replaced */
    run(m, image, SIDE, T, 2, NULL, maps);
    lgd_free(&m);
}

TEST(infer_halves_as_their_floats)
{
    static float image[SIDE * SIDE * 3], half[VALUES], full[VALUES];
    lgd_model *m = load(tiny());
    lgd_free(&m);
    make_image(image, SIDE);
    write_as(path_of("tiny.safetensors"), path_of("half"), NN_F16, NULL, 0);
    write_as(path_of("half"), path_of("full"), NN_F32, NULL, 0);
    maps_of(path_of("half"), image, half);
    maps_of(path_of("full"), image, full);
    for (int i = 0; i < VALUES; i++)
        CHECK(half[i] == full[i], "value %d is %.9g, of floats %.9g", i, (double)half[i], (double)full[i]);
}

TEST(infer_halves_that_are_not_finite)
{
    static const char name[] = "g.down1.conv2.weight";
    static const uint16_t numbers[] = {0x7c00, 0xfc00, 0x7e01};
    lgd_model *m = load(tiny());
    lgd_free(&m);
    write_as(path_of("tiny.safetensors"), path_of("half"), NN_F16, NULL, 0);
    for (int i = 0; i < 3; i++) {
        lgd_error e = {0};
        write_as(path_of("half"), path_of("bad"), NN_F16, name, numbers[i]);
        CHECK(!lgd_load(path_of("bad"), &e) && e.code == TS_NUMERIC && strstr(e.message, name) &&
                  strstr(e.message, "not finite"),
              "%04x: '%s'", numbers[i], e.message);
    }
}
