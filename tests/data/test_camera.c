/* What the camera does to a photograph. */
#include "data/camera.h"
#include "data/develop.h"
#include "data/image/image.h"
#include "tensor/rng.h"
#include "tests/test.h"
#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { SIZE = 37, N = SIZE * SIZE * 3 };
static const io_camera every = {.noise = 1,
                                .noise_spread = 1,
                                .blur = 8,
                                .quantise = true,
                                .exposure = 1,
                                .vignette = 0.5f,
                                .white_balance = 0.2f,
                                .jpeg = 40};

static io_rig place(const io_camera *c, uint64_t seed, uint64_t index, float distance)
{
    io_rig rig = {{0, 0, distance}, {0, 0, distance}, 1};
    io_camera_rig(c, seed, index, &rig);
    return rig;
}

static void fill(float *image, float largest)
{
    ts_rng r = ts_rng_make(5, TS_STREAM_TEST, 0);
    for (int i = 0; i < N; i++) image[i] = largest * ts_rng_uniform(&r);
}

TEST(camera_without_faults_only_clips)
{
    static float clean[N], a[N];
    io_camera none = {0};
    const io_rig rig = place(&none, 1, 2, 0.75f);
    fill(clean, 1.5f);
    memcpy(a, clean, sizeof a);
    io_camera_apply(&none, 1, 2, SIZE, a);
    for (int i = 0; i < N; i++) CHECK(a[i] == fminf(clean[i], 1), "value %d: %g became %g", i, clean[i], a[i]);
    CHECK(rig.camera[0] == 0 && rig.camera[1] == 0 && rig.camera[2] == 0.75f && rig.power == 1, "stands at %g %g %g",
          rig.camera[0], rig.camera[1], rig.camera[2]);
    CHECK(io_camera_exposure(&none, 1, 2) == 1, "exposure %g", io_camera_exposure(&none, 1, 2));
}

/* The noise, blur and rounding of a camera without the other faults, written down plainly. */
TEST(camera_noise_blur_and_rounding_are_what_they_were)
{
    static float clean[N], a[N], b[N], c[N];
    const io_camera camera = {.noise = 0.8f, .blur = 12, .quantise = true};
    for (uint64_t index = 0; index < 6; index++) {
        fill(clean, 1.2f);
        memcpy(a, clean, sizeof a);
        io_camera_apply(&camera, 3, index, SIZE, a);
        ts_rng r = ts_rng_make(3, TS_STREAM_CAMERA, index);
        const float sigma = camera.blur * ts_rng_uniform(&r) * SIZE / 256, strength = camera.noise * ts_rng_uniform(&r);
        const int reach = fminf(ceilf(3 * sigma), 12);
        float tap[25], total = 0;
        for (int k = -reach; k <= reach; k++) total += tap[k + reach] = expf(-0.5f * (float)(k * k) / (sigma * sigma));
        for (int i = 0; i < N; i++) b[i] = fminf(clean[i], 1);
        for (int pass = 0; pass < 2 && sigma > 0.15f; pass++) {
            for (int i = 0; i < N; i++) {
                const int at = pass ? i / (3 * SIZE) : i / 3 % SIZE, step = pass ? 3 * SIZE : 3;
                c[i] = 0;
                for (int k = -reach; k <= reach; k++) {
                    const int to = at + k < 0 ? 0 : at + k >= SIZE ? SIZE - 1 : at + k;
                    c[i] += tap[k + reach] / total * b[i + (to - at) * step];
                }
            }
            memcpy(b, c, sizeof b);
        }
        for (int i = 0; i < N; i++) {
            float v = fminf(b[i], 1);
            v += sqrtf(0.0001f * strength * strength + 0.002f * strength * v) * ts_rng_normal(&r);
            const float level = io_linear_to_srgb(fminf(fmaxf(v, 0), 1)) * 255, given = io_linear_to_srgb(a[i]) * 255;
            CHECK(fabsf(given - level) < 0.502f && fabsf(given - roundf(given)) < 0.01f,
                  "photograph %d, value %d: %g, not %g rounded", (int)index, i, given, level);
        }
    }
}

TEST(camera_is_a_function_of_seed_and_index)
{
    static float clean[N], a[N], b[N];
    fill(clean, 1.2f);
    for (uint64_t index = 0; index < 8; index++) {
        memcpy(a, clean, sizeof a);
        memcpy(b, clean, sizeof b);
        io_camera_apply(&every, 1, index, SIZE, a);
        io_camera_apply(&every, 1, index, SIZE, b);
        CHECK(!memcmp(a, b, sizeof a), "photograph %d differs from itself", (int)index);
        for (int i = 0; i < N; i++) {
            const float level = io_linear_to_srgb(a[i]) * 255;
            CHECK(a[i] >= 0 && a[i] <= 1 && fabsf(level - roundf(level)) < 0.01f, "value %g is not one of 256 levels",
                  a[i]);
        }
        memcpy(b, clean, sizeof b);
        io_camera_apply(&every, 1, index + 100, SIZE, b);
        CHECK(memcmp(a, b, sizeof a), "photographs %d and %d have the same faults", (int)index, (int)index + 100);
        memcpy(b, clean, sizeof b);
        io_camera_apply(&every, 2, index, SIZE, b);
        CHECK(memcmp(a, b, sizeof a), "seeds 1 and 2 give the same faults");
    }
}

TEST(camera_light_stays_within_its_ranges)
{
    static float a[N];
    float least = 9, most = 0, redder = 9, bluer = 0, darkest = 1;
    for (uint64_t index = 0; index < 200; index++) {
        const io_camera exposure = {.exposure = 1.5f}, balance = {.white_balance = 0.2f}, vignette = {.vignette = 0.4f};
        for (int i = 0; i < N; i++) a[i] = 0.3f;
        io_camera_apply(&exposure, 1, index, SIZE, a);
        const float factor = io_camera_exposure(&exposure, 1, index);
        for (int i = 0; i < N; i++)
            CHECK(fabsf(a[i] - fminf(0.3f * factor, 1)) < 1e-6f, "exposure %g makes %g of 0.3", factor, a[i]);
        CHECK(fabsf(log2f(factor)) <= 1.5f, "exposure %g", factor);
        least = fminf(least, factor);
        most = fmaxf(most, factor);

        for (int i = 0; i < N; i++) a[i] = 0.3f;
        io_camera_apply(&balance, 1, index, SIZE, a);
        CHECK(a[1] == 0.3f && fabsf(a[0] / 0.3f - 1) < 0.2001f && fabsf(a[2] / 0.3f - 1) < 0.2001f,
              "white balance %g %g %g", a[0], a[1], a[2]);
        redder = fminf(redder, a[0] / a[2]);
        bluer = fmaxf(bluer, a[0] / a[2]);

        for (int i = 0; i < N; i++) a[i] = 0.3f;
        io_camera_apply(&vignette, 1, index, SIZE, a);
        const int middle = 3 * (SIZE / 2 * SIZE + SIZE / 2);
        CHECK(fabsf(a[middle] - 0.3f) < 1e-6f && a[0] <= a[3 * (SIZE / 2)] && a[0] >= 0.3f * 0.599f && a[0] == a[N - 3],
              "vignette: corner %g", a[0]);
        darkest = fminf(darkest, a[0]);
    }
    CHECK(least < 0.4f && most > 2.5f && redder < 0.75f && bluer > 1.3f && darkest < 0.2f,
          "ranges are not used: %g %g, %g %g, %g", least, most, redder, bluer, darkest);
}

TEST(camera_meter_spares_white_pictures)
{
    static float clean[N], a[N];
    const io_camera free = {.exposure = 1.5f}, metered = {.exposure = 1.5f, .meter = 0.4f};
    int less = 0;
    for (uint64_t index = 0; index < 60; index++) {
        fill(clean, index % 3 ? 1.5f : 0.2f);
        const float factor = io_camera_meter(&metered, 1, index, SIZE, clean);
        CHECK(io_camera_meter(&free, 1, index, SIZE, clean) == 1, "a camera that does not meter does");
        double before = 0, after = 0;
        memcpy(a, clean, sizeof a);
        io_camera_apply(&free, 1, index, SIZE, a);
        for (int i = 0; i < N; i++) before += a[i] / (double)N, a[i] = clean[i] * factor;
        io_camera_apply(&metered, 1, index, SIZE, a);
        for (int i = 0; i < N; i++) after += a[i] / (double)N;
        if (before <= 0.4) CHECK(factor == 1, "a mean of %g is made %g", before, after);
        else CHECK(factor < 1 && after > 0.395 && after < 0.43, "a mean of %g becomes %g", before, after);
        less += factor < 1;
    }
    CHECK(less > 10 && less < 40, "%d of 60 are metered", less);
}

/* Whatever the material's brightness and the drawn exposure, in the share of the photographs that is asked for. */
TEST(camera_chooses_its_exposure)
{
    static float clean[N];
    const io_camera camera = {.exposure = 1.5f, .meter = 0.5f, .automatic = 0.6f};
    int chosen = 0, spared = 0;
    for (uint64_t index = 0; index < 100; index++) {
        const io_camera never = {.exposure = 1.5f, .meter = 0.5f};
        fill(clean, index % 2 ? 0.05f : 0.8f);
        for (int i = 0; i < N / 50; i++) clean[i * 50] = 5; /* glints */
        const float factor = io_camera_meter(&camera, 1, index, SIZE, clean);
        if (factor == io_camera_meter(&never, 1, index, SIZE, clean)) continue;
        const float exposure = factor * io_camera_exposure(&camera, 1, index);
        double mean = 0, burnt = 0;
        for (int i = 0; i < N; i++) {
            mean += fmin((double)(clean[i] * exposure), 1) / N;
            burnt += clean[i] * exposure > 1.0f ? 1.0 / N : 0;
        }
        chosen++;
        spared += burnt < 0.019; /* not the glints */
        CHECK(burnt < 0.031 && mean < 0.35, "%g are burnt out, the mean is %g", burnt, mean);
        CHECK(mean > 0.06 || burnt < 0.019, "the mean is %g, and %g are burnt out", mean, burnt);
    }
    CHECK(chosen > 45 && chosen < 75 && spared > 5, "%d of 100 are chosen, of %d glints are spared", chosen, spared);
}

TEST(camera_stands_at_its_distance_within_tilt_and_offset)
{
    const io_camera tilted = {.tilt = 5}, off = {.off_centre = 0.1f}, both = {.tilt = 5, .off_centre = 0.1f};
    float steepest = 0, farthest = 0, mean[2] = {0};
    for (uint64_t index = 0; index < 500; index++) {
        const io_rig turned = place(&tilted, 1, index, 2), moved = place(&off, 1, index, 2),
                     rig = place(&both, 1, index, 2);
        const float *p = turned.camera, *q = moved.camera, *r = rig.camera;
        const float across = hypotf(p[0], p[1]), angle = atan2f(across, p[2]) * 57.29578f;
        CHECK(fabsf(across * across + p[2] * p[2] - 4) < 1e-4f && angle <= 5.001f, "tilt %g at distance %g", angle,
              hypotf(across, p[2]));
        steepest = fmaxf(steepest, angle);
        mean[0] += p[0] / 500, mean[1] += p[1] / 500;
        CHECK(hypotf(q[0], q[1]) <= 0.1001f && q[2] == 2, "off centre by %g", hypotf(q[0], q[1]));
        farthest = fmaxf(farthest, hypotf(q[0], q[1]));
        CHECK(fabsf(r[0] - p[0] - q[0]) < 1e-6f && fabsf(r[1] - p[1] - q[1]) < 1e-6f && r[2] == p[2],
              "tilt and offset do not add");
        CHECK(!memcmp(rig.light, r, sizeof rig.light) && rig.power == 1, "the light leaves the camera");
    }
    CHECK(steepest > 4.8f && farthest > 0.098f && hypotf(mean[0], mean[1]) < 0.02f,
          "ranges are not used: %g %g, mean %g %g", steepest, farthest, mean[0], mean[1]);
}

TEST(camera_flash_is_beside_the_lens)
{
    const io_camera camera = {.flash = 0.2f, .tilt = 10, .off_centre = 0.1f, .fov_min = 20, .fov_max = 75};
    float farthest = 0, mean[2] = {0}, logarithm = 0;
    for (uint64_t index = 0; index < 1000; index++) {
        const io_rig rig = place(&camera, 1, index, 1);
        const float x = rig.light[0] - rig.camera[0], y = rig.light[1] - rig.camera[1];
        CHECK(rig.light[2] == rig.camera[2] && hypotf(x, y) < 0.20001f, "the flash is %g %g %g from the lens", x, y,
              rig.light[2] - rig.camera[2]);
        farthest = fmaxf(farthest, hypotf(x, y));
        mean[0] += x / 1000, mean[1] += y / 1000;
        logarithm += logf(rig.power) / 2000;
    }
    CHECK(farthest > 0.195f && hypotf(mean[0], mean[1]) < 0.015f, "largest offset %g, mean %g %g", farthest, mean[0],
          mean[1]);
    const float ends = logf(0.5f / tanf(0.17453293f)) + logf(0.5f / tanf(0.65449847f));
    CHECK(fabsf(logarithm - ends / 2) < 0.05f, "mean logarithm of the distance %g, not %g", logarithm, ends / 2);
}

TEST(camera_tells_the_share_that_is_asked_for)
{
    const io_camera camera = {.told_view = 0.3f, .told_power = 0.8f}, all = {.told_view = 1};
    int views = 0, powers = 0, both = 0;
    bool view, power;
    for (uint64_t index = 0; index < 2000; index++) {
        io_camera_told(&camera, 1, index, &view, &power);
        views += view, powers += power, both += view && power;
        io_camera_told(&all, 1, index, &view, &power);
        CHECK(view && !power, "shares of 1 and 0 give %d and %d", view, power);
    }
    CHECK(abs(views - 600) < 80 && abs(powers - 1600) < 70 && abs(both - 480) < 80, "told %d %d, both %d of 2000",
          views, powers, both);
}

TEST(camera_tone_curve_rises_from_0_to_1)
{
    const io_camera strong = {.tone = 1}, none = {0};
    float steepest = 0, darkest = 1, brightest = 0, lowest = 1;
    int clips = 0;
    for (uint64_t index = 0; index < 300; index++) {
        const io_tone t = io_camera_tone(&strong, 1, index), identity = io_camera_tone(&none, 1, index);
        CHECK(io_tone_curve(&t, 0) == 0 && io_tone_curve(&t, 1) == 1, "curve %d ends at %g and %g", (int)index,
              io_tone_curve(&t, 0), io_tone_curve(&t, 1));
        CHECK(io_tone_shoulder(&t, 0) == 0 && io_tone_shoulder(&t, 9) == 1, "shoulder %d ends at %g", (int)index,
              io_tone_shoulder(&t, 9));
        for (int k = 0; k < 1000; k++) {
            const float v = (float)k / 1000, after = v + 0.001f;
            const float rise = (io_tone_curve(&t, after) - io_tone_curve(&t, v)) / 0.001f;
            CHECK(rise > 0, "curve %d falls at %g", (int)index, v);
            CHECK(io_tone_curve(&identity, v) == v && io_tone_shoulder(&identity, v) == v, "no tone changes %g", v);
            const float w = 3 * v, rolled = io_tone_shoulder(&t, w), more = io_tone_shoulder(&t, w + 0.003f);
            CHECK(rolled <= more + 1e-6f && more - rolled < 0.00301f && rolled <= w + 1e-6f,
                  "shoulder %d goes from %g to %g at %g", (int)index, rolled, more, w);
            steepest = fmaxf(steepest, rise);
        }
        clips += t.knee == 1;
        lowest = fminf(lowest, t.knee);
        darkest = fminf(darkest, io_tone_curve(&t, 0.5f));
        brightest = fmaxf(brightest, io_tone_curve(&t, 0.5f));
    }
    CHECK(steepest > 1.25f && darkest < 0.44f && brightest > 0.57f && lowest < 0.45f && abs(clips - 150) < 40,
          "ranges are not used: %g, %g %g, %g, %d", steepest, darkest, brightest, lowest, clips);
}

/* The table between two powf is the curve itself, as close as no 8 bits show. */
TEST(camera_tone_is_its_curve_on_the_encoded_picture)
{
    static float clean[N], a[N];
    const io_camera camera = {.tone = 1};
    fill(clean, 1.5f);
    for (uint64_t index = 0; index < 20; index++) {
        const io_tone t = io_camera_tone(&camera, 2, index);
        memcpy(a, clean, sizeof a);
        io_camera_apply(&camera, 2, index, SIZE, a);
        for (int i = 0; i < N; i++) {
            const float want = io_tone_curve(&t, io_linear_to_srgb(fminf(io_tone_shoulder(&t, clean[i]), 1)));
            CHECK(fabsf(io_linear_to_srgb(a[i]) - want) < 1e-4f, "photograph %d: %g became %g, not %g", (int)index,
                  clean[i], io_linear_to_srgb(a[i]), want);
        }
    }
}

TEST(camera_sharpening_keeps_constants_and_raises_edges)
{
    enum { SIDE = 128, VALUES = SIDE * SIDE * 3 };
    static float a[VALUES];
    const io_camera camera = {.sharpen = 2, .quantise = true};
    float most = 0;
    for (uint64_t index = 0; index < 40; index++) {
        for (int i = 0; i < VALUES; i++) a[i] = io_srgb_to_linear((float)(40 + 60 * (i % 3)) / 255);
        io_camera_apply(&camera, 1, index, SIDE, a);
        for (int i = 0; i < VALUES; i++)
            CHECK(fabsf(io_linear_to_srgb(a[i]) * 255 - (float)(40 + 60 * (i % 3))) < 0.01f, "a constant became %g",
                  io_linear_to_srgb(a[i]) * 255);
        for (int i = 0; i < VALUES; i++) a[i] = io_srgb_to_linear(i / 3 % SIDE < SIDE / 2 ? 0.2f : 0.6f);
        io_camera_apply(&camera, 1, index, SIDE, a);
        float least = 1;
        for (int i = 0; i < VALUES; i++) {
            least = fminf(least, io_linear_to_srgb(a[i]));
            most = fmaxf(most, io_linear_to_srgb(a[i]));
        }
        CHECK(least < 0.201f && fabsf(io_linear_to_srgb(a[0]) - 0.2f) < 0.01f, "away from the edge %g",
              io_linear_to_srgb(a[0]));
    }
    CHECK(most > 0.75f && most < 1, "the edge rises to %g", most);
}

TEST(camera_ambient_light_has_its_share)
{
    const io_camera camera = {.ambient = 0.4f}, none = {0};
    float most = 0, steepest = 0, flattest = 1, bluest = 1;
    CHECK(io_camera_ambient(&none, 1, 1).share == 0 && io_camera_ambient(&none, 1, 1).side[1] == 0, "light from none");
    for (uint64_t index = 0; index < 500; index++) {
        const io_ambient a = io_camera_ambient(&camera, 1, index);
        const float *d = a.direction;
        CHECK(fabsf(a.uniform[1] + a.side[1] - a.share) < 1e-6f && a.share >= 0 && a.share <= 0.4f, "%g + %g of %g",
              a.uniform[1], a.side[1], a.share);
        CHECK(fabsf(d[0] * d[0] + d[1] * d[1] + d[2] * d[2] - 1) < 1e-5f, "direction %g %g %g", d[0], d[1], d[2]);
        most = fmaxf(most, a.share);
        steepest = fmaxf(steepest, d[2]), flattest = fminf(flattest, d[2]);
        bluest = fminf(bluest, a.uniform[0] / a.uniform[2]);
    }
    CHECK(most > 0.39f && steepest > 0.9f && flattest < 0.4f && bluest < 0.7f, "ranges are not used: %g, %g %g, %g",
          most, flattest, steepest, bluest);
}

static uint64_t fnv(uint64_t hash, const void *bytes, size_t count)
{
    for (size_t i = 0; i < count; i++) hash = (hash ^ ((const uint8_t *)bytes)[i]) * UINT64_C(1099511628211);
    return hash;
}

/* A key that is off leaves the bytes of photographs as they are, whatever keys there are. */
TEST(camera_photographs_keep_their_bytes)
{
    static float a[N];
    uint64_t hash = UINT64_C(14695981039346656037);
    for (uint64_t index = 0; index < 20; index++) {
        io_camera c = every;
        c.tilt = 10, c.off_centre = 0.2f;
        for (int i = 0; i < N; i++) a[i] = (float)((i * 37 + (int)index) % 101) * 0.012f;
        io_camera_apply(&c, 5, index, SIZE, a);
        const io_rig rig = place(&c, 5, index, 0.9765625f);
        hash = fnv(fnv(hash, a, sizeof a), rig.camera, sizeof rig.camera);
    }
    CHECK(hash == UINT64_C(0x6970392e942fc8b2), "hash 0x%016llx", (unsigned long long)hash);
}
