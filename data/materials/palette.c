#include "data/materials/palette.h"
#include "data/image/image.h"
#include <math.h>

static void move(io_canvas *c, io_rgb v, float stops, float saturation, float hue)
{
    float grey = 0.2126f * v[0] + 0.7152f * v[1] + 0.0722f * v[2];
    float f = exp2f(cv_range(c, -stops, stops)), s = 1 + cv_range(c, -saturation, saturation),
          warm = cv_range(c, -hue, hue);
    for (int k = 0; k < 3; k++) {
        float tilt = 1 + (k == 0 ? warm : k == 2 ? -warm : 0);
        v[k] = nz_clamp((grey + (v[k] - grey) * s) * f * tilt, 0.004f,
                        0.9f); /* the range of real albedos; soot is 0.004 */
    }
}

void pal_pick(io_canvas *c, const uint32_t *colours, int count, float spread, io_rgb out)
{
    uint32_t v = colours[ts_rng_int(&c->rng, count)];
    for (int k = 0; k < 3; k++) out[k] = io_srgb_to_linear((float)(v >> (16 - 8 * k) & 255) / 255);
    move(c, out, spread, 0.25f, 0.06f);
}

void pal_vary(io_canvas *c, const io_rgb in, float stops, io_rgb out)
{
    for (int k = 0; k < 3; k++) out[k] = in[k];
    move(c, out, stops, 0.35f, 0.1f);
}

void pal_scale(io_rgb colour, float factor)
{
    for (int k = 0; k < 3; k++) colour[k] = nz_clamp(colour[k] * factor, 0.004f, 0.9f);
}

void pal_paint(io_canvas *c, io_rgb out)
{
    static const uint32_t neutral[] = {0xf2efe6, 0xe4e0d4, 0xcfcac0, 0xb5b3ae, 0x8c8c8a, 0x6a6b6d, 0x4a4b4d,
                                       0x333435, 0x232324, 0x161617, 0x2a2622, 0x5b544b, 0x0e0e10};
    static const uint32_t muted[] = {0x6d7f6a, 0x4d5d53, 0x7a8a94, 0x475766, 0x2d3a4c, 0x8b6f5a, 0x6b4a3a, 0x9c8a6e,
                                     0x7d3f35, 0x5a2a27, 0xa99a7f, 0x3c4a3a, 0x59524e, 0x1f2b38, 0x24302a, 0x3a1d1c};
    static const uint32_t vivid[] = {0xb3281e, 0xc8571b, 0xd9a520, 0x2f6b35, 0x1d4f91, 0x1a7a86,
                                     0x4a2d52, 0x8c1f2f, 0x14305e, 0xd8c63a, 0x0f5a4a};
    float u = cv_range(c, 0, 1);
    if (u < 0.5f) pal_pick(c, neutral, PAL_COUNT(neutral), 0.4f, out);
    else if (u < 0.87f) pal_pick(c, muted, PAL_COUNT(muted), 0.5f, out);
    else pal_pick(c, vivid, PAL_COUNT(vivid), 0.5f, out);
}

io_substance pal_dielectric(io_canvas *c, const io_rgb colour, float roughness)
{
    /* Most polymers, stones and lacquers reflect 0.04; water and cloth less, glass and glazes a little more. */
    float u = cv_range(c, 0, 1),
          f0 = u < 0.6f ? 0.04f
        : u < 0.8f      ? cv_range(c, 0.02f, 0.04f)
                        : cv_range(c, 0.04f, 0.065f);
    io_substance s = {{colour[0], colour[1], colour[2]}, {f0, f0, f0}, roughness};
    return s;
}

io_substance pal_metal(io_canvas *c, float roughness)
{
    /* F0 of clean metals, linear (Naty Hoffman, "Background: Physics and Math of Shading", SIGGRAPH course 2013, table
     * 2), with their alloys. */
    static const io_rgb table[] = {{0.56f, 0.57f, 0.58f}, {0.56f, 0.57f, 0.58f}, {0.91f, 0.92f, 0.92f},
                                   {0.91f, 0.92f, 0.92f}, {0.55f, 0.55f, 0.55f}, {0.66f, 0.61f, 0.53f},
                                   {0.66f, 0.69f, 0.72f}, {0.95f, 0.93f, 0.88f}, {0.95f, 0.64f, 0.54f},
                                   {0.95f, 0.64f, 0.54f}, {0.72f, 0.50f, 0.30f}, {0.89f, 0.76f, 0.42f},
                                   {1.00f, 0.77f, 0.34f}, {0.54f, 0.50f, 0.45f}};
    const float *f0 = table[ts_rng_int(&c->rng, PAL_COUNT(table))];
    /* Grime and oxide darken: a third of the metals is clean, the rest has down to a sixth of the reflectance, and
     * reddens as it goes. */
    float age = cv_chance(c, 0.4f) ? cv_range(c, 0.88f, 1) : cv_log_range(c, 0.13f, 0.95f),
          warm = (1 - age) * cv_range(c, 0, 0.45f);
    io_substance s = {{0, 0, 0}, {f0[0] * age, f0[1] * age * (1 - 0.4f * warm), f0[2] * age * (1 - warm)}, roughness};
    float grey = cv_chance(c, 0.55f) ? 0 : cv_log_range(c, 0.001f, 0.03f); /* the dust that lies on it */
    for (int k = 0; k < 3; k++) s.diffuse[k] = grey;
    return s;
}
