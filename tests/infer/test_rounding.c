/* What rounding may change in the maps of the weights that ship: real photographs at two sizes, computed in two ways.
 * The bounds are those that lgd.h, the README, --help and docs/accuracy.md state. LGD_ISA chooses the set. */
#include "data/image/image.h"
#include "infer/lgd.h"
#include "infer/photograph.h"
#include "tensor/cpu.h"
#include "tensor/maps.h"
#include "tests/test.h"
#include <dirent.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { PARTS = 4, MOST_PIXELS = 1 << 24 };
static const struct {
    const char *name;
    int first, end;
} parts[PARTS] = {{"diffuse", 0, 3}, {"normal", 3, 5}, {"roughness", 5, 6}, {"specular", 6, 9}};

/* One way to compute. A model's weights are packed for one instruction set. */
typedef struct way {
    ts_isa isa;
    int exact, precision;
    double fov; /* degrees, or LGD_FOV_UNKNOWN */
    lgd_model *model;
    float *maps;
    const char *weights;
} way;

static void begin(way *w, int side)
{
    lgd_error e;
    ts_isa_use(w->isa);
    w->model = lgd_load(w->weights, &e);
    CHECK(w->model, "%s", e.message);
    w->maps = malloc((size_t)side * (size_t)side * MAP_CHANNELS * sizeof *w->maps);
    CHECK(w->maps, "out of memory");
}

static void end(way *w)
{
    lgd_free(&w->model);
    free(w->maps);
}

static void estimate(way *w, const float *image, int side)
{
    lgd_error e;
    lgd_options o = lgd_options_default();
    double power;
    o.exact = w->exact, o.precision = w->precision, o.power = &power, o.threads = 1, o.fov = w->fov;
    ts_isa_use(w->isa);
    CHECK(!lgd_estimate(w->model, image, side, &o, w->maps, &e), "%s", e.message);
}

/* Of all photographs: the largest RMS of a photograph's map, the largest difference of a value, and the largest share
 * of a photograph's values that differ by more than FAR. */
#define FAR 0.05
typedef struct difference {
    double rms[PARTS], most[PARTS], far;
} difference;

static void compare(const float *a, const float *b, int pixels, difference *d)
{
    int far = 0;
    for (int k = 0; k < PARTS; k++) {
        double squares = 0;
        for (int p = 0; p < pixels; p++)
            for (int c = parts[k].first; c < parts[k].end; c++) {
                const double off = fabs((double)a[p * MAP_CHANNELS + c] - (double)b[p * MAP_CHANNELS + c]);
                squares += off * off;
                d->most[k] = fmax(d->most[k], off);
                far += off > FAR;
            }
        d->rms[k] = fmax(d->rms[k], sqrt(squares / (pixels * (parts[k].end - parts[k].first))));
    }
    d->far = fmax(d->far, far / ((double)pixels * MAP_CHANNELS));
}

/* a against b: every photograph at 256 pixels, every third at 512. */
static void photographs(const char *what, const char *weights, way a, way b, double rms, double most)
{
    a.weights = b.weights = weights;
    char folder[1024], path[2048];
    snprintf(folder, sizeof folder, "%s/photos", test_data());
    struct dirent **names;
    const int files = scandir(folder, &names, NULL, alphasort);
    CHECK(files > 0, "%s cannot be read", folder);
    for (int side = 256, every = 1; side <= 512; side *= 2, every = 3) {
        difference d = {{0}, {0}, 0};
        int seen = 0, compared = 0;
        begin(&a, side), begin(&b, side);
        for (int i = 0; i < files; i++) {
            if (names[i]->d_name[0] == '.' || seen++ % every != every / 2) continue;
            io_image square = {0};
            io_photo_facts facts;
            ts_status st = {0};
            snprintf(path, sizeof path, "%s/%s", folder, names[i]->d_name);
            CHECK(!lgd_photograph_square(path, false, MOST_PIXELS, side, 1, &square, &facts, &st), "%s", st.message);
            estimate(&a, square.data, side), estimate(&b, square.data, side);
            compare(a.maps, b.maps, side * side, &d);
            io_image_free(&square);
            compared++;
        }
        end(&a), end(&b);
        printf("  %s, %s, %d photographs at %d:", what, weights, compared, side);
        for (int k = 0; k < PARTS; k++) printf(" %s %.2g, %.2g at most;", parts[k].name, d.rms[k], d.most[k]);
        printf(" %.2g of a photograph's values by more than %g\n", d.far, FAR);
        CHECK(compared * every >= 26, "%d photographs", compared);
        CHECK(d.most[0] > 0, "%s: the same bytes", what);
        CHECK(a.fov > LGD_FOV_UNKNOWN || d.far < 1e-4, "%s at %d: %.2g of a photograph's values differ by more than %g",
              what, side, d.far, FAR);
        for (int k = 0; k < PARTS; k++)
            CHECK(d.rms[k] < rms && d.most[k] < most, "%s at %d: %s differs by %.2g (RMS), by %.2g at most", what, side,
                  parts[k].name, d.rms[k], d.most[k]);
    }
    for (int i = 0; i < files; i++) free(names[i]);
    free(names);
}

TEST(rounding_of_winograds_algorithm)
{
    const way direct = {.isa = ts_isa_now(), .exact = 1}, fast = {.isa = ts_isa_now()};
    photographs("Winograd", "models/phone.safetensors", direct, fast, 1e-5, 1e-3);
    photographs("Winograd", "models/single.safetensors", direct, fast, 1e-5, 1e-3);
}

TEST(rounding_of_instruction_sets)
{
    const way base = {.isa = TS_BASE, .exact = 1}, now = {.isa = ts_isa_now(), .exact = 1};
    if (now.isa == TS_BASE) test_skip("base is what the others are held against");
    photographs(ts_isa_name(now.isa), "models/phone.safetensors", base, now, 1e-5, 1e-3);
    photographs(ts_isa_name(now.isa), "models/single.safetensors", base, now, 1e-5, 1e-3);
}

/* In a known view the maps say little of how rough a sample is as a whole where the photograph does not, and the
 * scene's fit looks far for that level. */
TEST(rounding_to_bf16_in_a_known_view)
{
    const way f32 = {.isa = ts_isa_now(), .fov = 54.2}, bf16 = {.isa = f32.isa, .fov = f32.fov, .precision = LGD_BF16};
    photographs("bf16, field of view given", "models/phone.safetensors", f32, bf16, 0.05, 0.8);
}

/* The largest difference of ten million values is that of one glossy pixel, and which pixel it is depends on the order
 * of an instruction set's sums: of single .15 with base, .205 with avx2. The shares and means above do not. */
TEST(rounding_to_bf16)
{
    const way f32 = {.isa = ts_isa_now()}, bf16 = {.isa = ts_isa_now(), .precision = LGD_BF16};
    photographs("bf16", "models/phone.safetensors", f32, bf16, 0.005, 0.8);
    photographs("bf16", "models/single.safetensors", f32, bf16, 0.005, 0.3);
}
