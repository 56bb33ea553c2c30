#include "data/image/colour.h"
#include "data/image/image.h"
#include <math.h>
#include <string.h>

/* IEC 61966-2-1. Both directions go on above 1, and the straight part below 0. */
float io_srgb_to_linear(float v) { return v <= 0.04045f ? v / 12.92f : powf((v + 0.055f) / 1.055f, 2.4f); }
float io_linear_to_srgb(float v) { return v <= 0.0031308f ? v * 12.92f : 1.055f * powf(v, 1 / 2.4f) - 0.055f; }

static float table_value(const io_curve *curve, float v)
{
    float x = v * (float)(curve->count - 1);
    int i = !(x > 0) ? 0 : x >= (float)(curve->count - 1) ? curve->count - 2 : (int)x;
    const uint8_t *t = curve->table + 2 * i;
    float a = (float)(t[0] << 8 | t[1]) / 65535, b = (float)(t[2] << 8 | t[3]) / 65535;
    return a + (b - a) * (x - (float)i); /* beyond the ends, the last piece goes on */
}

/* ITU-R BT.2100, table 4, over the 203 cd/m² of HDR's reference white (ITU-R BT.2408). */
static float pq(float v)
{
    const float p = powf(fmaxf(v, 0), 32 / 2523.0f),
                light = fmaxf(p - 3424 / 4096.0f, 0) / fmaxf(2413 / 128.0f - 2392 / 128.0f * p, 1e-6f);
    return powf(light, 8192 / 1305.0f) * (10000 / 203.0f);
}

/* BT.2100, table 5, the light of the scene; reference white is at .75 of the signal. */
static float hlg_scene(float v)
{
    return v <= 0.5f ? v * v / 3 : (expf((v - 0.55991073f) / 0.17883277f) + 0.28466892f) / 12;
}
static float hlg(float v) { return hlg_scene(fmaxf(v, 0)) / hlg_scene(0.75f); }

float io_curve_value(const io_curve *curve, float v)
{
    const float *p = curve->p;
    switch (curve->kind) {
    case IO_CURVE_LINEAR: return v;
    case IO_CURVE_SRGB: return io_srgb_to_linear(v);
    case IO_CURVE_PARAMETRIC: return v >= p[4] ? powf(fmaxf(p[1] * v + p[2], 0), p[0]) + p[5] : p[3] * v + p[6];
    case IO_CURVE_TABLE: return table_value(curve, v);
    case IO_CURVE_PQ: return pq(v);
    case IO_CURVE_HLG: return hlg(v);
    }
    return v;
}

static void set_curves(io_space *space, io_curve curve)
{
    for (int c = 0; c < 3; c++) space->curve[c] = curve;
}

io_space io_space_linear(void)
{
    io_space s = {.identity = true, .matrix = {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}};
    return s;
}

io_space io_space_srgb(void)
{
    io_space s = io_space_linear();
    set_curves(&s, (io_curve){.kind = IO_CURVE_SRGB});
    return s;
}

static bool invert(const double m[3][3], double out[3][3])
{
    for (int i = 0; i < 3; i++)
        for (int j = 0; j < 3; j++) {
            int a = (j + 1) % 3, b = (j + 2) % 3, c = (i + 1) % 3, d = (i + 2) % 3;
            out[i][j] = m[a][c] * m[b][d] - m[a][d] * m[b][c];
        }
    double det = m[0][0] * out[0][0] + m[0][1] * out[1][0] + m[0][2] * out[2][0];
    if (!(fabs(det) > 1e-9)) return false;
    for (int i = 0; i < 9; i++) out[i / 3][i % 3] /= det;
    return true;
}

static void multiply(const double a[3][3], const double b[3][3], double out[3][3])
{
    for (int i = 0; i < 3; i++)
        for (int j = 0; j < 3; j++) out[i][j] = a[i][0] * b[0][j] + a[i][1] * b[1][j] + a[i][2] * b[2][j];
}

/* From linear values of the given primaries to XYZ relative to D50 (the ICC's connection space), with the Bradford
 * adaptation (ICC.1:2010, annex E). */
static bool to_d50(const float xy[8], double out[3][3])
{
    static const double bradford[3][3] = {{.8951, .2664, -.1614}, {-.7502, 1.7135, .0367}, {.0389, -.0685, 1.0296}};
    static const double d50[3] = {.9642, 1, .8249};
    double primaries[3][3], inverse[3][3], back[3][3], adapt[3][3], scaled[3][3], white[3], gain[3];
    for (int c = 0; c < 4; c++) {
        double x = xy[2 * c], y = xy[2 * c + 1];
        /* primaries may be imaginary, as those of ACES2065-1 (SMPTE ST 2065-1), whose blue has a y below 0 */
        if (!((c < 3 ? fabs(y) : y) > 1e-4) || !(fabs(x) < 10) || !(fabs(y) < 10)) return false;
        double xyz[3] = {x / y, 1, (1 - x - y) / y};
        for (int i = 0; i < 3; i++) {
            if (c < 3) primaries[i][c] = xyz[i];
            else white[i] = xyz[i];
        }
    }
    if (!invert(primaries, inverse) || !invert(bradford, back)) return false;
    for (int c = 0; c < 3; c++) {
        double level = inverse[c][0] * white[0] + inverse[c][1] * white[1] + inverse[c][2] * white[2];
        for (int i = 0; i < 3; i++) primaries[i][c] *= level;
    }
    for (int i = 0; i < 3; i++) {
        double from = 0, to = 0;
        for (int j = 0; j < 3; j++) {
            from += bradford[i][j] * white[j];
            to += bradford[i][j] * d50[j];
        }
        gain[i] = to / from;
    }
    for (int i = 0; i < 9; i++) scaled[i / 3][i % 3] = bradford[i / 3][i % 3] * gain[i / 3];
    multiply(back, scaled, adapt);
    multiply(adapt, primaries, out);
    return true;
}

/* The matrix from a space's XYZ (D50) matrix; rounding of a profile's numbers is taken for what was meant. */
static bool set_matrix(io_space *space, const double xyz[3][3])
{
    static const float srgb[8] = {.64f, .33f, .3f, .6f, .15f, .06f, .3127f, .329f};
    double to_xyz[3][3], from_xyz[3][3], m[3][3];
    if (!to_d50(srgb, to_xyz) || !invert(to_xyz, from_xyz)) return false;
    multiply(from_xyz, xyz, m);
    bool same = true;
    for (int i = 0; i < 9; i++) {
        if (!isfinite(m[i / 3][i % 3]) || fabs(m[i / 3][i % 3]) > 100) return false;
        same = same && fabs(m[i / 3][i % 3] - (i % 4 == 0)) < 3e-3;
    }
    *space = io_space_linear();
    space->identity = same;
    for (int i = 0; i < 9 && !same; i++) space->matrix[i / 3][i % 3] = (float)m[i / 3][i % 3];
    return true;
}

bool io_space_primaries(const float xy[8], float gamma, io_space *space)
{
    double xyz[3][3];
    if (!to_d50(xy, xyz) || !set_matrix(space, xyz)) return false;
    io_curve srgb = {.kind = IO_CURVE_SRGB}, power = {.kind = IO_CURVE_PARAMETRIC, .p = {gamma, 1}},
             linear = {.kind = IO_CURVE_LINEAR};
    set_curves(space, gamma == 0 ? srgb : gamma == 1 ? linear : power);
    return true;
}

io_space io_space_adobe_rgb(void)
{
    static const float xy[8] = {.64f, .33f, .21f, .71f, .15f, .06f, .3127f, .329f};
    io_space s;
    return io_space_primaries(xy, 563 / 256.0f, &s) ? s : io_space_srgb(); /* Adobe RGB (1998), 4.3.1.2 */
}

bool io_space_code_points(const int point[2], io_space *space)
{
    static const float bt2020[8] = {.708f, .292f, .17f, .797f, .131f, .046f, .3127f, .329f};
    static const float bt709[8] = {.64f, .33f, .3f, .6f, .15f, .06f, .3127f, .329f};
    static const float p3[8] = {.68f, .32f, .265f, .69f, .15f, .06f, .3127f, .329f};
    const float *xy = point[0] == 9 ? bt2020 : point[0] == 12 ? p3 : point[0] == 1 ? bt709 : NULL;
    io_curve curve = {.kind = IO_CURVE_LINEAR};
    switch (point[1]) {
    case 1:
    case 6:
    case 13:
    case 14:
    case 15: curve.kind = IO_CURVE_SRGB; break;
    case 8: break;
    case 16: curve.kind = IO_CURVE_PQ; break;
    case 18: curve.kind = IO_CURVE_HLG; break;
    default: return false;
    }
    if (point[0] == 2 && curve.kind != IO_CURVE_SRGB && curve.kind != IO_CURVE_LINEAR) xy = bt2020;
    if (!xy || !io_space_primaries(xy, 0, space)) return false;
    set_curves(space, curve);
    return true;
}

void io_space_matrix(const io_space *space, float rgb[3])
{
    float in[3] = {rgb[0], rgb[1], rgb[2]};
    for (int c = 0; c < 3; c++) {
        const float *m = space->matrix[c];
        float v = space->identity ? in[c] : m[0] * in[0] + m[1] * in[1] + m[2] * in[2];
        /* NaN fails the first comparison. No photograph means more than the largest half float; infinity would spread
         * in every average. */
        rgb[c] = v > 0 ? fminf(v, 65504) : 0;
    }
}

void io_space_apply(const io_space *space, const float in[3], float out[3])
{
    for (int c = 0; c < 3; c++) out[c] = io_curve_value(&space->curve[c], in[c]);
    io_space_matrix(space, out);
}

/* --- ICC profiles (ICC.1:2010, section 7 and 10) --- */

static uint32_t be32(const uint8_t *p)
{
    return (uint32_t)p[0] << 24 | (uint32_t)p[1] << 16 | (uint32_t)p[2] << 8 | p[3];
}
static float fixed(const uint8_t *p) { return (float)(int32_t)be32(p) / 65536; }

/* The bytes of a tag, at least need of them; NULL when absent or outside the profile. */
static const uint8_t *find_tag(const uint8_t *b, size_t size, const char *name, size_t need, size_t *length)
{
    uint32_t count = be32(b + 128);
    for (uint32_t i = 0; i < count && 132 + 12 * (size_t)(i + 1) <= size; i++) {
        const uint8_t *entry = b + 132 + 12 * (size_t)i;
        if (memcmp(entry, name, 4)) continue;
        size_t at = be32(entry + 4), n = be32(entry + 8);
        if (at > size || n > size - at || n < need) return NULL;
        *length = n;
        return b + at;
    }
    return NULL;
}

static bool read_curve(const uint8_t *b, size_t size, const char *name, io_curve *curve)
{
    static const int parameters[5] = {1, 3, 4, 5, 7};
    size_t n = 0;
    const uint8_t *t = find_tag(b, size, name, 12, &n);
    if (!t) return false;
    memset(curve, 0, sizeof *curve);
    if (!memcmp(t, "para", 4)) {
        int kind = t[8] << 8 | t[9];
        if (kind > 4 || n < 12 + 4 * (size_t)parameters[kind]) return false;
        float v[7] = {0};
        for (int i = 0; i < parameters[kind]; i++) v[i] = fixed(t + 12 + 4 * i);
        curve->kind = IO_CURVE_PARAMETRIC;
        memcpy(curve->p, v, sizeof v);
        if (kind == 0) curve->p[1] = 1;
        /* Types 1 and 2 begin at -b/a, with 0 and c below. */
        if (kind == 1 || kind == 2) {
            if (v[1] == 0) return false;
            curve->p[3] = 0;
            curve->p[4] = -v[2] / v[1];
            curve->p[5] = curve->p[6] = kind == 2 ? v[3] : 0;
        }
        return true;
    }
    if (memcmp(t, "curv", 4)) return false;
    size_t count = be32(t + 8);
    if (count > (n - 12) / 2) return false;
    if (count == 0) curve->kind = IO_CURVE_LINEAR;
    else if (count == 1) *curve = (io_curve){.kind = IO_CURVE_PARAMETRIC, .p = {(float)(t[12] << 8 | t[13]) / 256, 1}};
    else *curve = (io_curve){.kind = IO_CURVE_TABLE, .table = t + 12, .count = (int)count};
    return true;
}

static bool nearly_srgb(const io_curve *curve)
{
    for (int i = 0; i <= 64; i++) {
        float v = (float)i / 64;
        if (!(fabsf(io_curve_value(curve, v) - io_srgb_to_linear(v)) < 2e-3f)) return false;
    }
    return true;
}

bool io_space_icc(const uint8_t *b, size_t size, io_space *space)
{
    static const char *const curves[] = {"rTRC", "gTRC", "bTRC"}, *const colorants[] = {"rXYZ", "gXYZ", "bXYZ"};
    if (!b || size < 132 || memcmp(b + 36, "acsp", 4)) return false;
    /* Tables go before curves and a matrix (9.2), and of Lab a grey's curve gives L* (8.3). */
    size_t table = 0;
    if (find_tag(b, size, "A2B0", 8, &table) || find_tag(b, size, "A2B1", 8, &table)) return false;
    if (memcmp(b + 20, "XYZ ", 4)) return false;
    if (!memcmp(b + 16, "GRAY", 4)) {
        io_curve curve;
        if (!read_curve(b, size, "kTRC", &curve)) return false;
        *space = io_space_linear();
        set_curves(space, nearly_srgb(&curve) ? (io_curve){.kind = IO_CURVE_SRGB} : curve);
        return true;
    }
    if (memcmp(b + 16, "RGB ", 4)) return false;
    double xyz[3][3];
    for (int c = 0; c < 3; c++) {
        size_t n = 0;
        const uint8_t *t = find_tag(b, size, colorants[c], 20, &n);
        if (!t || memcmp(t, "XYZ ", 4)) return false;
        for (int i = 0; i < 3; i++) xyz[i][c] = fixed(t + 8 + 4 * i);
    }
    if (!set_matrix(space, xyz)) return false;
    bool srgb = true;
    for (int c = 0; c < 3; c++) {
        if (!read_curve(b, size, curves[c], &space->curve[c])) return false;
        srgb = srgb && nearly_srgb(&space->curve[c]);
    }
    if (srgb) set_curves(space, (io_curve){.kind = IO_CURVE_SRGB});
    return true;
}
