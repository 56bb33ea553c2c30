/* LPIPS against PyTorch: tests/eval/lpips_reference.py says what the weights and pictures are and made the numbers. */
#include "eval/metrics/lpips.h"
#include "nn/weights/file.h"
#include "tensor/threads.h"
#include "tests/test.h"
#include <math.h>
#include <stdlib.h>
#include <string.h>

static double uniform(const char *name, uint64_t i)
{
    uint64_t z = 0xcbf29ce484222325;
    for (; *name; name++) z = (z ^ (unsigned char)*name) * 0x100000001b3;
    z += i * 0x9E3779B97F4A7C15;
    z = (z ^ z >> 30) * 0xBF58476D1CE4E5B9;
    z = (z ^ z >> 27) * 0x94D049BB133111EB;
    z ^= z >> 31;
    return (double)(z >> 40) / (1 << 23) - 1;
}

static nn_tensor formula(const char *name, int rank, const int64_t *dim, double scale, bool positive)
{
    nn_tensor e = {.name = strdup(name), .rank = rank, .count = 1};
    for (int i = rank - 1; i >= 0; i--) {
        e.dim[i] = dim[i];
        e.stride[i] = e.count;
        e.count *= dim[i];
    }
    float *v = malloc((size_t)e.count * sizeof *v);
    for (int64_t i = 0; i < e.count; i++) {
        v[i] = (float)scale * (float)uniform(name, (uint64_t)i);
        if (positive) v[i] = fabsf(v[i]);
    }
    e.data = (const unsigned char *)v;
    return e;
}

static char trunk[512], linear[512];

static ev_lpips *network(void)
{
    static const int number[] = {0, 3, 6, 8, 10}, in[] = {3, 64, 192, 384, 256}, out[] = {64, 192, 384, 256, 256},
                     kernel[] = {11, 5, 3, 3, 3};
    nn_tensor t[10], l[5];
    ts_status st = {0};
    char name[64];
    for (int i = 0; i < 5; i++) {
        snprintf(name, sizeof name, "features.%d.weight", number[i]);
        t[2 * i] = formula(name, 4, (int64_t[]){out[i], in[i], kernel[i], kernel[i]},
                           sqrt(6.0 / (in[i] * kernel[i] * kernel[i])), false);
        snprintf(name, sizeof name, "features.%d.bias", number[i]);
        t[2 * i + 1] = formula(name, 1, (int64_t[]){out[i]}, 0.1, false);
        snprintf(name, sizeof name, "lin%d.model.1.weight", i);
        l[i] = formula(name, 4, (int64_t[]){1, out[i], 1, 1}, 1, true);
    }
    const char *where = getenv("LPIPS_OUT"); /* tests/cli/eval.sh wants them too */
    snprintf(trunk, sizeof trunk, "%s/alexnet.pth", where ? where : test_folder());
    snprintf(linear, sizeof linear, "%s/alex.safetensors", where ? where : test_folder());
    CHECK(!nn_file_write(trunk, NN_FORM_TORCH_ZIP, t, 10, NN_DTYPES, NULL, 0, NULL, &st), "%s", st.message);
    CHECK(!nn_file_write(linear, NN_FORM_SAFETENSORS, l, 5, NN_DTYPES, NULL, 0, NULL, &st), "%s", st.message);
    ev_lpips *net = ev_lpips_load(trunk, linear, &st);
    CHECK(net, "%s", st.message);
    return net;
}

static float *picture(const char *name, int h, int w)
{
    float *v = malloc((size_t)h * (size_t)w * 3 * sizeof *v);
    for (int i = 0; i < h * w * 3; i++) {
        const int c = i % 3, x = i / 3 % w, y = i / 3 / w;
        const double value = 0.5 + 0.35 * cos(0.07 * x + 0.11 * y + c) +
            0.25 * (double)(float)uniform(name, (uint64_t)i);
        v[i] = (float)fmin(fmax(value, 0), 1);
    }
    return v;
}

TEST(eval_lpips_is_pytorchs)
{
    ev_lpips *net = network();
    FILE *f = fopen("tests/eval/lpips_reference.txt", "r");
    char line[512];
    int cases = 0;
    CHECK(f, "tests/eval/lpips_reference.txt is missing");
    while (fgets(line, sizeof line, f)) {
        int h, w;
        double wanted[5], tap[5], sum = 0;
        if (*line == '#') continue;
        CHECK(sscanf(line, "%d %d %lf %lf %lf %lf %lf", &h, &w, wanted, wanted + 1, wanted + 2, wanted + 3,
                     wanted + 4) == 7,
              "'%s'", line);
        float *a = picture("a", h, w), *b = picture("b", h, w);
        const double d = ev_lpips_distance(net, h, w, a, b, tap);
        for (int l = 0; l < 5; l++) {
            CHECK(fabs(tap[l] - wanted[l]) <= 2e-6 * wanted[l], "%d x %d, tap %d: %.9g, not %.9g", h, w, l, tap[l],
                  wanted[l]);
            sum += tap[l];
        }
        CHECK(fabs(d - sum) < 1e-12 * sum, "the terms do not add up");
        CHECK(fabs(ev_lpips_distance(net, h, w, b, a, NULL) - d) < 1e-9 * d &&
                  ev_lpips_distance(net, h, w, a, a, NULL) == 0,
              "no distance");
        const int before = ts_threads();
        ts_threads_set(before == 3 ? 2 : 3);
        CHECK(ev_lpips_distance(net, h, w, a, b, NULL) == d, "other bytes with other threads");
        ts_threads_set(before);
        CHECK(isnan(ev_lpips_distance(net, 30, w, a, b, NULL)) && isnan(ev_lpips_distance(net, h, 30, a, b, NULL)),
              "a picture too small for the network has a distance");
        free(a);
        free(b);
        cases++;
    }
    fclose(f);
    CHECK(cases == 5, "%d cases", cases);
    ev_lpips_free(&net);
    CHECK(!net, "free leaves the pointer");
}

TEST(eval_lpips_weights_that_are_none)
{
    ev_lpips *net = network();
    ev_lpips_free(&net);
    ts_status st = {0};
    CHECK(!ev_lpips_load(linear, linear, &st) && strstr(st.message, "features.0.weight") && strstr(st.message, linear),
          "'%s'", st.message);
    CHECK(!ev_lpips_load(trunk, trunk, &st) && strstr(st.message, "lin0.model.1.weight") && strstr(st.message, trunk),
          "'%s'", st.message);
    CHECK(!ev_lpips_load("/nowhere", linear, &st) && strstr(st.message, "/nowhere"), "'%s'", st.message);
    CHECK(!ev_lpips_load(trunk, "/nowhere", &st) && strstr(st.message, "/nowhere"), "'%s'", st.message);
}
