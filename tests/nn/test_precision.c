/* What bf16 changes in the maps of the weights that ship with the program. */
#include "data/materials/procedural.h"
#include "infer/lgd.h"
#include "tensor/conv/conv.h"
#include "tensor/maps.h"
#include "tests/test.h"
#include "train/state.h"
#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { SIDE = 128, PIXELS = SIDE * SIDE, VALUES = PIXELS * MAP_CHANNELS, COUNT = 12 };

static lgd_model *shipped(void)
{
    const char *given = getenv("LGD_TEST_MODEL");
    lgd_error e;
    lgd_model *m = lgd_load(given && *given ? given : "models/single.safetensors", &e);
    CHECK(m, "%s", e.message);
    return m;
}

/* The sum of squares of a - b over channels [first, end). */
static double squares(const float *a, const float *b, int first, int end)
{
    double sum = 0;
    for (int p = 0; p < PIXELS; p++)
        for (int c = first; c < end; c++)
            sum += ((double)a[p * MAP_CHANNELS + c] - b[p * MAP_CHANNELS + c]) *
                ((double)a[p * MAP_CHANNELS + c] - b[p * MAP_CHANNELS + c]);
    return sum;
}

/* Photographs of procedural materials as in training, with the camera's noise, JPEG and a light of unknown power. */
TEST(precision_bf16_maps_of_the_shipped_model)
{
    static float truth[VALUES], image[PIXELS * 3], maps[2][VALUES];
    static const struct {
        const char *name;
        int first, end;
    } parts[] = {{"diffuse", 0, 3}, {"normal", 3, 5}, {"roughness", 5, 6}, {"specular", 6, 9}};
    lgd_model *m = shipped();
    const tr_config c = tr_config_default();
    const io_procedural p = {.seed = 77};
    double all = 0, part[4] = {0}, worst = 0;
    for (int i = 0; i < COUNT; i++) {
        io_material material = {.size = SIDE, .maps = truth};
        io_procedural_make(&p, (uint64_t)i, &material);
        tr_photographs(&c, 77, (uint64_t)i, 1, SIDE, truth, NULL, 1, image, NULL);
        for (int precision = LGD_F32; precision <= LGD_BF16; precision++) {
            lgd_options o = lgd_options_default();
            lgd_error e;
            o.precision = precision;
            CHECK(lgd_estimate(m, image, SIDE, &o, maps[precision], &e) == 0, "%s", e.message);
        }
        const double one = squares(maps[0], maps[1], 0, MAP_CHANNELS);
        all += one;
        worst = fmax(worst, sqrt(one / VALUES));
        for (int k = 0; k < 4; k++)
            part[k] += squares(maps[0], maps[1], parts[k].first, parts[k].end) / (parts[k].end - parts[k].first);
    }
    const double rms = sqrt(all / VALUES / COUNT);
    printf("  bf16 - f32: RMS %.5f, of the worst photograph %.5f", rms, worst);
    for (int k = 0; k < 4; k++) printf(", %s %.5f", parts[k].name, sqrt(part[k] / PIXELS / COUNT));
    puts("");
    CHECK(rms > 0, "bf16 gives f32's bytes");
    CHECK(worst <= 0.005, "the maps of a photograph differ by %.5f (RMS)", worst);
    lgd_free(&m);
}
