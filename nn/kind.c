#include "nn/kind.h"
#include "tensor/maps.h"
#include <math.h>

#define DIFFUSE_OF_METAL 0.05f
#define F0_OF_PLASTIC 0.04f

/* Of samples whose kind is told: the most that a metal scatters, the most mean F0 that is a dielectric's, and the
 * standard deviations of encoded values. */
#define MOST_DIFFUSE_OF_METAL 0.02f
#define MOST_F0_OF_DIELECTRIC 0.1f
#define DEVIATION_OF_KIND 0.02f

static float encoded(float v) { return 2 * fminf(fmaxf(v, 0), 1) - 1; }

static double mean_of(int64_t pixels, int channels, const float *maps, int map)
{
    double sum = 0;
    for (int64_t i = 0; i < pixels; i++)
        for (int c = 0; c < 3; c++) sum += ((double)maps[i * channels + map + c] + 1) / 2;
    return sum / (3 * (double)pixels);
}

bool nn_is_metal(int64_t pixels, int channels, const float *maps)
{
    return mean_of(pixels, channels, maps, MAP_SPECULAR) > mean_of(pixels, channels, maps, MAP_DIFFUSE);
}

void nn_change_kind(bool metal, int64_t pixels, int channels, float *maps)
{
    for (int64_t i = 0; i < pixels; i++, maps += channels)
        for (int c = 0; c < 3; c++) {
            const float diffuse = (maps[MAP_DIFFUSE + c] + 1) / 2, f0 = (maps[MAP_SPECULAR + c] + 1) / 2;
            maps[MAP_DIFFUSE + c] = encoded(metal ? diffuse + f0 / NN_METAL_F0 : DIFFUSE_OF_METAL);
            maps[MAP_SPECULAR + c] = encoded(metal ? F0_OF_PLASTIC : f0 + NN_METAL_F0 * diffuse);
        }
}

static void make_metal(int64_t pixels, int channels, float *maps)
{
    for (int64_t i = 0; i < pixels; i++, maps += channels)
        for (int c = 0; c < 3; c++) {
            const float diffuse = (maps[MAP_DIFFUSE + c] + 1) / 2, f0 = (maps[MAP_SPECULAR + c] + 1) / 2;
            maps[MAP_SPECULAR + c] = encoded(f0 + NN_METAL_F0 * diffuse);
            maps[MAP_DIFFUSE + c] = encoded(fminf(diffuse, MOST_DIFFUSE_OF_METAL));
        }
}

/* F0 times keep; diffuse too, or, added, what F0 loses. */
static void make_dielectric(float keep, bool added, int64_t pixels, int channels, float *maps)
{
    for (int64_t i = 0; i < pixels; i++, maps += channels)
        for (int c = 0; c < 3; c++) {
            const float diffuse = (maps[MAP_DIFFUSE + c] + 1) / 2, f0 = (maps[MAP_SPECULAR + c] + 1) / 2;
            maps[MAP_SPECULAR + c] = encoded(keep * f0);
            maps[MAP_DIFFUSE + c] = encoded(added ? diffuse + (1 - keep) * f0 / NN_METAL_F0 : keep * diffuse);
        }
}

float nn_take_kind(nn_kind kind, bool power_known, int64_t pixels, int channels, float *maps)
{
    if (kind == NN_KIND_METAL) make_metal(pixels, channels, maps);
    if (kind != NN_KIND_DIELECTRIC) return 0;
    const double f0 = mean_of(pixels, channels, maps, MAP_SPECULAR);
    if (f0 <= (double)MOST_F0_OF_DIELECTRIC) return 0;
    const float keep = F0_OF_PLASTIC / (float)f0;
    make_dielectric(keep, power_known, pixels, channels, maps);
    return power_known ? 0 : -log2f(keep);
}

void nn_deviations_of_kind(nn_kind kind, int64_t pixels, float *deviation)
{
    if (kind == NN_KIND_UNKNOWN) return;
    const int group = kind == NN_KIND_METAL ? GROUP_DIFFUSE : GROUP_SPECULAR;
    for (int64_t i = group; i < pixels * MAP_GROUPS; i += MAP_GROUPS)
        deviation[i] = fminf(deviation[i], DEVIATION_OF_KIND);
}
