#include "data/materials/collected.h"
#include <math.h>

enum { SIDE = IO_COLLECTION_SIDE, MOST_SAMPLES = 4 };
#define PI 3.14159265358979323846f
#define METAL 0.15f /* F0 from which on a pixel is none of a dielectric */

/* From patch widths to pixels of the set. */
typedef struct view {
    float right[2], up[2], origin[2], share;
} view;

static view draw_view(io_canvas *c)
{
    view v = {.share = cv_log_range(c, 0.4f, 1)};
    const float quarter = floorf(cv_range(c, 0, 4)), any = cv_range(c, 0, 4), mirror = cv_chance(c, 0.5f) ? -1 : 1;
    const float angle = PI / 2 * (cv_chance(c, 0.3f) ? any : quarter), x = cosf(angle), y = sinf(angle);
    const float side = v.share * SIDE;
    v.right[0] = side * x;
    v.right[1] = side * y;
    v.up[0] = mirror * side * y;
    v.up[1] = -mirror * side * x;
    v.origin[0] = cv_range(c, 0, SIDE);
    v.origin[1] = cv_range(c, 0, SIDE);
    return v;
}

/* The place in the set of the patch's (x, y), both 0 .. SIDE. */
typedef struct place {
    int at[4];
    float weight[4];
} place;

static float around(float x) { return x - SIDE * floorf(x / SIDE); }

static place find(const view *v, float x, float y)
{
    const float s = around(v->origin[0] + v->right[0] * x + v->up[0] * y),
                t = around(v->origin[1] + v->right[1] * x + v->up[1] * y);
    const int i = (int)s % SIDE, j = (int)t % SIDE, k = (i + 1) % SIDE, l = (j + 1) % SIDE;
    const float a = s - floorf(s), b = t - floorf(t);
    return (place){{j * SIDE + i, j * SIDE + k, l * SIDE + i, l * SIDE + k},
                   {(1 - a) * (1 - b), a * (1 - b), (1 - a) * b, a * b}};
}

static void add(const io_collected *set, const place *p, float share, float sum[1 + IO_COLLECTED])
{
    for (int n = 0; n < 4; n++) {
        const float w = share * p->weight[n];
        const io_collected *from = &set[p->at[n]];
        sum[0] += w * from->height;
        for (int k = 0; k < IO_COLLECTED; k++) sum[1 + k] += w * (float)from->value[k];
    }
}

/* The levels of roughness and of a dielectric's F0. */
static void other_levels(io_canvas *c)
{
    const float rougher = expf(cv_range(c, -0.7f, 0.5f)), brighter = cv_log_range(c, 0.5f, 2);
    for (int i = 0; i < c->count; i++) {
        c->roughness[i] = fminf(fmaxf(rougher * c->roughness[i], 0.03f), 1);
        const float f0 = (c->specular[0][i] + c->specular[1][i] + c->specular[2][i]) / 3;
        const float dielectric = fmaxf(1 - f0 / METAL, 0);
        for (int k = 0; k < 3; k++) c->specular[k][i] *= nz_mix(1, brighter, dielectric);
    }
}

void cv_collected(io_canvas *c, const io_collected *set)
{
    const view v = draw_view(c);
    const float footprint = v.share * SIDE * c->pixel; /* pixels of the set that one of the patch is as wide as */
    const int samples = footprint <= 1 ? 1 : footprint < MOST_SAMPLES ? (int)ceilf(footprint) : MOST_SAMPLES;
    const float step = c->pixel / (float)samples, share = 1 / (float)(samples * samples);
    for (int i = 0; i < c->count; i++) {
        float sum[1 + IO_COLLECTED] = {0};
        for (int n = 0; n < samples * samples; n++) {
            const float dx = ((float)(n % samples) + 0.5f) * step - 0.5f * c->pixel,
                        dy = ((float)(n / samples) + 0.5f) * step - 0.5f * c->pixel;
            const place p = find(&v, c->x[i] + dx, c->y[i] + dy);
            add(set, &p, share, sum);
        }
        c->height[i] = sum[0] / v.share;
        for (int k = 0; k < 3; k++) {
            c->diffuse[k][i] = sum[1 + k] / 65535;
            c->specular[k][i] = sum[4 + k] / 65535;
        }
        c->roughness[i] = sum[7] / 65535;
    }
    if (cv_chance(c, 0.5f)) other_levels(c);
}
