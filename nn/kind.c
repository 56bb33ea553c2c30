#include "nn/kind.h"
#include "tensor/maps.h"
#include <math.h>

#define DIFFUSE_OF_METAL 0.05f
#define F0_OF_PLASTIC 0.04f

/* Of samples whose kind is told: the most that a metal scatters, the least mean F0 that is a metal's and the most that
 * is a dielectric's, and the standard deviations of encoded values. */
#define MOST_DIFFUSE_OF_METAL 0.02f
#define LEAST_F0_OF_METAL 0.4f
#define MOST_F0_OF_DIELECTRIC 0.1f
#define DEVIATION_OF_KIND 0.02f

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
            maps[MAP_DIFFUSE + c] = map_stored(metal ? diffuse + f0 / NN_METAL_F0 : DIFFUSE_OF_METAL);
            maps[MAP_SPECULAR + c] = map_stored(metal ? F0_OF_PLASTIC : f0 + NN_METAL_F0 * diffuse);
        }
}

static void make_metal(int64_t pixels, int channels, float *maps)
{
    for (int64_t i = 0; i < pixels; i++, maps += channels)
        for (int c = 0; c < 3; c++) {
            const float diffuse = (maps[MAP_DIFFUSE + c] + 1) / 2, f0 = (maps[MAP_SPECULAR + c] + 1) / 2;
            maps[MAP_SPECULAR + c] = map_stored(f0 + NN_METAL_F0 * diffuse);
            maps[MAP_DIFFUSE + c] = map_stored(fminf(diffuse, MOST_DIFFUSE_OF_METAL));
        }
}

static void brighten(float by, int64_t pixels, int channels, float *maps)
{
    for (int64_t i = 0; i < pixels; i++, maps += channels)
        for (int c = 0; c < 3; c++) maps[MAP_SPECULAR + c] = map_stored(by * (maps[MAP_SPECULAR + c] + 1) / 2);
}

/* F0 times keep; diffuse too, or, added, what F0 loses. */
static void make_dielectric(float keep, bool added, int64_t pixels, int channels, float *maps)
{
    for (int64_t i = 0; i < pixels; i++, maps += channels)
        for (int c = 0; c < 3; c++) {
            const float diffuse = (maps[MAP_DIFFUSE + c] + 1) / 2, f0 = (maps[MAP_SPECULAR + c] + 1) / 2;
            maps[MAP_SPECULAR + c] = map_stored(keep * f0);
            maps[MAP_DIFFUSE + c] = map_stored(added ? diffuse + (1 - keep) * f0 / NN_METAL_F0 : keep * diffuse);
        }
}

float nn_take_kind(nn_kind kind, bool power_known, int64_t pixels, int channels, float *maps)
{
    if (kind == NN_KIND_UNKNOWN) return 0;
    if (kind == NN_KIND_METAL) make_metal(pixels, channels, maps);
    const float f0 = (float)mean_of(pixels, channels, maps, MAP_SPECULAR);
    const bool metal = kind == NN_KIND_METAL, fits = metal ? f0 >= LEAST_F0_OF_METAL : f0 <= MOST_F0_OF_DIELECTRIC;
    if (fits || (metal && power_known)) return 0;
    const float by = (metal ? LEAST_F0_OF_METAL : F0_OF_PLASTIC) / fmaxf(f0, 1e-3f);
    if (metal) brighten(by, pixels, channels, maps);
    else make_dielectric(by, power_known, pixels, channels, maps);
    return power_known ? 0 : -log2f(by);
}

void nn_deviations_of_kind(nn_kind kind, int64_t pixels, float *deviation)
{
    if (kind == NN_KIND_UNKNOWN) return;
    const int group = kind == NN_KIND_METAL ? GROUP_DIFFUSE : GROUP_SPECULAR;
    for (int64_t i = group; i < pixels * MAP_GROUPS; i += MAP_GROUPS)
        deviation[i] = fminf(deviation[i], DEVIATION_OF_KIND);
}
