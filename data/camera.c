#include "data/camera.h"
#include "data/develop.h"
#include "data/glare.h"
#include "data/image/image.h"
#include "data/image/srgb_code.h"
#include "data/materials/noise.h"
#include "tensor/rng.h"
#include "tensor/scratch.h"
#include <math.h>
#include <stddef.h>
#include <string.h>

/* Every fault is drawn, whether it is switched on or not, so that one key changes one fault. */
typedef struct faults {
    float exposure, read, shot, vignette, red, blue, tilt, tilt_turn, away, away_turn, jpeg;
    bool halved;
} faults;

static faults draw(uint64_t seed, uint64_t index)
{
    ts_rng r = ts_rng_make(seed, TS_STREAM_PHOTOGRAPH, index);
    faults f;
    f.exposure = ts_rng_range(&r, -1, 1);
    f.read = ts_rng_range(&r, -1, 1);
    f.shot = ts_rng_range(&r, -1, 1);
    f.vignette = ts_rng_uniform(&r);
    f.red = ts_rng_range(&r, -1, 1);
    f.blue = ts_rng_range(&r, -1, 1);
    f.tilt = ts_rng_uniform(&r);
    f.tilt_turn = ts_rng_range(&r, 0, 6.2831853f);
    f.away = ts_rng_uniform(&r);
    f.away_turn = ts_rng_range(&r, 0, 6.2831853f);
    f.jpeg = ts_rng_uniform(&r);
    f.halved = ts_rng_uniform(&r) < 0.5f;
    return f;
}

/* What came after them, from a stream of its own. */
typedef struct phone {
    float fov, flash, flash_turn, told_view, told_power;
    float ambient, side, side_turn, side_height, warmth;
    float contrast, pivot, bend, knee, sharpen, radius;
    float flash_size, points_turn, glare;
    float automatic, aim, burnt;
    float lobes, broad, soften;
} phone;

static phone draw_phone(uint64_t seed, uint64_t index)
{
    ts_rng r = ts_rng_make(seed, TS_STREAM_PHONE, index);
    phone p;
    p.fov = ts_rng_uniform(&r);
    p.flash = ts_rng_uniform(&r);
    p.flash_turn = ts_rng_range(&r, 0, 6.2831853f);
    p.told_view = ts_rng_uniform(&r);
    p.told_power = ts_rng_uniform(&r);
    p.ambient = ts_rng_uniform(&r);
    p.side = ts_rng_uniform(&r);
    p.side_turn = ts_rng_range(&r, 0, 6.2831853f);
    p.side_height = ts_rng_range(&r, 0.35f, 1.2f); /* radians above the sample: 20 to 70 degrees */
    p.warmth = ts_rng_range(&r, -1, 1);
    p.contrast = ts_rng_range(&r, -0.25f, 1.2f);
    p.pivot = ts_rng_range(&r, 0.4f, 0.6f);
    p.bend = ts_rng_range(&r, -0.25f, 0.25f);
    p.knee = ts_rng_range(&r, -1, 1); /* every other photograph clips */
    p.sharpen = ts_rng_uniform(&r);
    p.radius = ts_rng_range(&r, 0.5f, 2);
    p.flash_size = ts_rng_uniform(&r);
    p.points_turn = ts_rng_range(&r, 0, 6.2831853f);
    p.glare = ts_rng_uniform(&r);
    p.automatic = ts_rng_uniform(&r);
    p.aim = ts_rng_range(&r, -1.2f, 1.2f);
    p.burnt = ts_rng_uniform(&r);
    p.lobes = ts_rng_uniform(&r);
    p.broad = ts_rng_range(&r, 1.3f, 2.5f);
    p.soften = ts_rng_uniform(&r);
    return p;
}

static float distance_at(float degrees) { return 0.5f / tanf(degrees * 0.0087266463f); }

void io_camera_rig(const io_camera *c, uint64_t seed, uint64_t index, io_rig *rig)
{
    const faults f = draw(seed, index);
    const phone p = draw_phone(seed, index);
    const float planned = rig->camera[2];
    float distance = planned;
    if (c->fov_max > 0) {
        const float nearest = distance_at(c->fov_max);
        distance = nearest * powf(distance_at(c->fov_min) / nearest, p.fov);
        rig->power *= distance * distance / (planned * planned);
    }
    const float angle = c->tilt * f.tilt * 0.017453293f, away = c->off_centre * f.away, across = distance * sinf(angle);
    const float by[3] = {away * cosf(f.away_turn) + across * cosf(f.tilt_turn),
                         away * sinf(f.away_turn) + across * sinf(f.tilt_turn), distance * cosf(angle) - planned};
    for (int k = 0; k < 3; k++) {
        rig->camera[k] += by[k];
        rig->light[k] += by[k];
    }
    const float aside = c->flash * sqrtf(p.flash); /* uniform over the disk */
    rig->light[0] += aside * cosf(p.flash_turn);
    rig->light[1] += aside * sinf(p.flash_turn);
}

void io_camera_told(const io_camera *c, uint64_t seed, uint64_t index, bool *view, bool *power)
{
    const phone p = draw_phone(seed, index);
    *view = p.told_view < c->told_view;
    *power = p.told_power < c->told_power;
}

io_ambient io_camera_ambient(const io_camera *c, uint64_t seed, uint64_t index)
{
    const phone p = draw_phone(seed, index);
    const float share = c->ambient * p.ambient, tint = exp2f(0.3f * p.warmth), across = cosf(p.side_height);
    const float colour[3] = {tint, 1, 1 / tint};
    io_ambient a = {.share = share,
                    .direction = {across * cosf(p.side_turn), across * sinf(p.side_turn), sinf(p.side_height)}};
    for (int k = 0; k < 3; k++) {
        a.side[k] = share * p.side * colour[k];
        a.uniform[k] = share * (1 - p.side) * colour[k];
    }
    return a;
}

io_disk io_camera_flash(const io_camera *c, uint64_t seed, uint64_t index, float distance)
{
    const phone p = draw_phone(seed, index);
    return (io_disk){.radius = c->flash_size * sqrtf(p.flash_size) * distance, .turn = p.points_turn};
}

io_reflection io_camera_reflection(const io_camera *c, uint64_t seed, uint64_t index)
{
    const phone p = draw_phone(seed, index);
    const float share = c->lobes * p.lobes;
    return (io_reflection){.share = share,
                           .broad = share > 0 ? p.broad : 1,
                           .narrow = share > 0 ? powf(p.broad, -share / (1 - share)) : 1,
                           .soft = 1 - c->soften * p.soften};
}

io_tone io_camera_tone(const io_camera *c, uint64_t seed, uint64_t index)
{
    const phone p = draw_phone(seed, index);
    return (io_tone){.contrast = c->tone * p.contrast,
                     .pivot = p.pivot,
                     .bend = c->tone * p.bend,
                     .knee = 1 - 0.6f * c->tone * (p.knee > 0 ? p.knee : 0)};
}

float io_camera_exposure(const io_camera *c, uint64_t seed, uint64_t index)
{
    return c->exposure > 0 ? exp2f(c->exposure * draw(seed, index).exposure) : 1;
}

/* The mean of the clamped values under an exposure. */
static float mean_under(float exposure, size_t count, const float *image)
{
    double sum = 0;
    for (size_t i = 0; i < count; i++) sum += (double)nz_min(image[i] * exposure, 1);
    return (float)(sum / (double)count);
}

/* The value that a share of an image's values is above, to a tenth of a stop. */
static float exceeded_by(float share, size_t count, const float *image)
{
    enum { STOP = 10, STOPS = 32, BINS = STOP * STOPS };
    size_t above[BINS] = {0}, sum = 0;
    for (size_t i = 0; i < count; i++) {
        const float stops = log2f(nz_max(image[i], 1e-6f)) + STOPS / 2;
        above[stops > 0 ? (int)nz_min(stops * STOP, BINS - 1) : 0]++;
    }
    int bin = BINS - 1;
    while (bin > 0 && (float)(sum += above[bin]) <= share * (float)count) bin--;
    return exp2f((float)(bin + 1) / STOP - STOPS / 2);
}

/* A phone's automatic exposure: a mean near a middle grey's, but with few values burnt out. */
static float automatic_exposure(const phone *p, size_t count, const float *image)
{
    const float aim = 0.15f * exp2f(p->aim), most = 1 / exceeded_by(0.03f * p->burnt * p->burnt, count, image);
    float exposure = 1;
    for (int round = 0; round < 6; round++)
        exposure = nz_min(nz_max(exposure * aim / nz_max(mean_under(exposure, count, image), 1e-4f), 0.1f), 10);
    return nz_min(exposure, nz_max(most, 0.1f));
}

float io_camera_meter(const io_camera *c, uint64_t seed, uint64_t index, int size, const float *image)
{
    const size_t count = (size_t)size * (size_t)size * 3;
    const float exposure = io_camera_exposure(c, seed, index);
    const phone p = draw_phone(seed, index);
    float factor = 1;
    if (p.automatic < c->automatic) return automatic_exposure(&p, count, image) / exposure;
    /* A clamped pixel does not darken with the factor: each round comes nearer from above. */
    for (int round = 0; c->meter > 0 && round < 4; round++) {
        const float mean = mean_under(exposure * factor, count, image);
        if (mean <= c->meter) break;
        factor *= c->meter / mean;
    }
    return factor;
}

static void expose(const io_camera *c, const faults *f, uint64_t seed, uint64_t index, int size, float *image)
{
    const float exposure = io_camera_exposure(c, seed, index), loss = c->vignette * f->vignette;
    const float gain[3] = {exposure * (1 + c->white_balance * f->red), exposure,
                           exposure * (1 + c->white_balance * f->blue)};
    for (int y = 0; y < size; y++)
        for (int x = 0; x < size; x++) {
            const float px = ((float)x + 0.5f) / (float)size - 0.5f, py = ((float)y + 0.5f) / (float)size - 0.5f;
            const float seen = 1 - loss * 2 * (px * px + py * py); /* the corner is sqrt(1/2) away */
            for (int k = 0; k < 3; k++) image[((size_t)y * (size_t)size + (size_t)x) * 3 + (size_t)k] *= gain[k] * seen;
        }
}

/* Of variance read^2 + gain v, clipped again. */
static void add_noise(ts_rng *rng, float read, float gain, size_t count, float *image)
{
    enum { PART = 1024 };
    float normal[PART];
    for (size_t begin = 0; begin < count; begin += PART, image += PART) {
        const int n = count - begin < PART ? (int)(count - begin) : PART;
        ts_rng_normals(rng, n, normal);
        for (int i = 0; i < n; i++)
            image[i] = nz_clamp(image[i] + __builtin_sqrtf(read * read + gain * image[i]) * normal[i], 0, 1);
    }
}

/* From linear light in [0, 1] to encoded values. */
static void develop(const io_camera *c, const io_tone *tone, uint64_t seed, uint64_t index, int size, float *image)
{
    const phone p = draw_phone(seed, index);
    io_tone_encode(tone, (size_t)size * (size_t)size * 3, image);
    if (c->sharpen > 0) io_sharpen(size, c->sharpen * p.sharpen, p.radius * (float)size / 256, image);
}

void io_camera_apply(const io_camera *c, uint64_t seed, uint64_t index, int size, float *image)
{
    ts_rng rng = ts_rng_make(seed, TS_STREAM_CAMERA, index);
    const faults f = draw(seed, index);
    float sigma = c->blur * ts_rng_uniform(&rng) * (float)size / 256;
    float strength = c->noise * ts_rng_uniform(&rng);
    /* Variance read^2 + gain * signal (Foi et al., "Practical Poissonian-Gaussian Noise Modeling and Fitting for
     * Single-Image Raw-Data", 2008). */
    float read = 0.01f * strength, gain = 0.002f * strength;
    if (c->noise_spread > 0) {
        read *= exp2f(c->noise_spread * f.read);
        gain *= exp2f(c->noise_spread * f.shot);
    }
    size_t count = (size_t)size * (size_t)size * 3;
    if (c->glare > 0) {
        const float drawn = draw_phone(seed, index).glare;
        io_glare(size, c->glare * drawn * drawn, image); /* clean lenses are more common than touched ones */
    }
    if (c->exposure > 0 || c->vignette > 0 || c->white_balance > 0) expose(c, &f, seed, index, size, image);
    const io_tone tone = io_camera_tone(c, seed, index);
    if (tone.knee < 1) io_tone_roll_off(&tone, count, image);
    for (size_t i = 0; i < count; i++) image[i] = nz_clamp(image[i], 0, 1);
    if (sigma > 0.15f) io_blur(size, 3, sigma, image); /* a narrower one is invisible in 8 bits */
    if (strength > 0) add_noise(&rng, read, gain, count, image);
    const bool developed = c->tone > 0 || c->sharpen > 0, coded = c->quantise || c->jpeg;
    if (developed) develop(c, &tone, seed, index, size, image);
    if (developed && !coded)
        for (size_t i = 0; i < count; i++) image[i] = io_srgb_to_linear(image[i]);
    if (!coded) return;
    const io_srgb_codes *srgb = io_srgb_codes_made();
    uint8_t *codes = ts_scratch(TS_SCRATCH_SLOTS - 1, count); /* the blur's: it is done */
    if (developed)
        for (size_t i = 0; i < count; i++) codes[i] = (uint8_t)(image[i] * 255 + 0.5f);
    else
        for (size_t i = 0; i < count; i++) codes[i] = (uint8_t)io_srgb_code(srgb, nz_clamp(image[i], 0, 1));
    if (c->jpeg) io_jpeg_codes(size, c->jpeg + (int)(f.jpeg * (float)(99 - c->jpeg)), f.halved, codes);
    for (size_t i = 0; i < count; i++) image[i] = srgb->linear[codes[i]];
}
