/* Printed, stuck and stencilled signs: lines of letters, arrows, warning signs, rings, bar codes,
 * striped bands, frames, with or without a label under them. Letters are strokes drawn at random, so that nothing is
 * spelled. */
#include "data/materials/palette.h"
#include "data/materials/weathering.h"
#include <math.h>

enum { TEXT, ARROW, WARNING, RING, BARS, BAND, FRAME, SIGNS };

typedef struct sign {
    int kind, lines;
    float half_w, half_h, thick; /* patch widths; thick: of strokes, in half heights */
    uint32_t seed;
} sign;

static float segment(float x, float y, float ax, float ay, float bx, float by)
{
    const float lx = bx - ax, ly = by - ay, t = nz_clamp(((x - ax) * lx + (y - ay) * ly) / (lx * lx + ly * ly), 0, 1);
    const float dx = x - ax - t * lx, dy = y - ay - t * ly;
    return sqrtf(dx * dx + dy * dy);
}

/* Distance to the strokes of a letter in the box [-0.3, 0.3] x [-0.5, 0.5]. */
static float letter(uint32_t bits, float x, float y)
{
    static const float stroke[8][4] = {{-.3f, -.5f, -.3f, .5f}, {.3f, -.5f, .3f, .5f},   {-.3f, .5f, .3f, .5f},
                                       {-.3f, 0, .3f, 0},       {-.3f, -.5f, .3f, -.5f}, {-.3f, -.5f, .3f, .5f},
                                       {-.3f, .5f, .3f, -.5f},  {0, -.5f, 0, .5f}};
    float d = 1;
    if (!(bits & 0x83)) bits |= 1; /* nearly every letter stands on an upright */
    for (int k = 0; k < 8; k++)
        if (bits >> k & 1 && (k < 5 || bits >> (k + 8) & 1))
            d = nz_min(d, segment(x, y, stroke[k][0], stroke[k][1], stroke[k][2], stroke[k][3]));
    return d;
}

/* Distance to the border of the ink at (x, y) from the sign's centre, in patch widths, negative inside. */
static float ink(const sign *s, float x, float y)
{
    const float w = s->half_w, h = s->half_h, t = s->thick * h;
    switch (s->kind) {
    case TEXT: {
        const float line = 2 * h / (float)s->lines, pitch = 0.6f * line, row = nz_floor((h - y) / line),
                    column = nz_floor((x + w) / pitch);
        const float length = 2 * w * (0.4f + 0.6f * nz_unit(nz_hash(-1, (int32_t)row, s->seed)));
        const uint32_t bits = nz_hash((int32_t)column, (int32_t)row, s->seed);
        if (row < 0 || row >= (float)s->lines || column < 0 || (column + 1) * pitch > length || bits >> 28 < 2)
            return h;
        const float size = 0.72f * line; /* of a letter; the rest is space */
        const float across = x + w - (column + 0.5f) * pitch, up = y - h + (row + 0.5f) * line;
        return size * letter(bits, across / (0.85f * size), up / size) - 0.3f * s->thick * line;
    }
    case ARROW: {
        const float head = nz_max(nz_abs(y) - 0.9f * (w - x), w - 1.2f * h - x),
                    shaft = nz_max(nz_abs(y) - 0.4f * h, nz_abs(x) - w + 0.3f * h);
        return nz_min(0.74f * head, nz_max(shaft, x - w + h));
    }
    case WARNING: {
        const float side = nz_max(0.866f * nz_abs(x) + 0.5f * y, -y) - 0.5f * h; /* a triangle standing on its side */
        const float mark =
            nz_min(segment(x, y, 0, -0.05f * h, 0, 0.4f * h), segment(x, y, 0, -0.3f * h, 0, -0.29f * h)) - 0.08f * h;
        return nz_min(nz_abs(side) - 0.5f * t, mark);
    }
    case RING: {
        const float r = sqrtf(x * x + y * y), ring = nz_abs(r - h + t) - t;
        return s->lines > 2 ? nz_min(ring, nz_max(nz_abs(x + y) - t, r - h)) : ring;
    }
    case BARS: {
        const float pitch = 0.07f * h, column = nz_floor(x / pitch), at = x - (column + 0.5f) * pitch;
        const float width = 0.5f * pitch * (0.3f + 0.9f * nz_unit(nz_hash((int32_t)column, 0, s->seed)));
        return nz_max(nz_abs(at) - width, nz_max(nz_abs(x) - w, nz_abs(y) - h));
    }
    case BAND: {
        const float p = (x + y) / (2 * h), across = nz_abs(p - nz_floor(p) - 0.5f) - 0.25f;
        return nz_max(1.414f * h * across, nz_max(nz_abs(x) - w, nz_abs(y) - h));
    }
    default: return nz_abs(nz_max(nz_abs(x) - w, nz_abs(y) - h) + t) - 0.6f * t;
    }
}

static sign draw_sign(io_canvas *c)
{
    sign s;
    s.kind = ts_rng_int(&c->rng, SIGNS);
    s.lines = 1 + ts_rng_int(&c->rng, 4);
    s.half_h = cv_log_range(c, 0.02f, 0.16f);
    const float aspect = cv_log_range(c, 1, 5);
    s.thick = cv_range(c, 0.1f, 0.25f);
    s.seed = cv_seed(c);
    if (s.kind == TEXT) s.half_h *= 0.5f * (float)s.lines;
    s.half_w = s.half_h *
        (s.kind == WARNING || s.kind == RING ? 1
             : s.kind == ARROW               ? nz_max(aspect, 1.6f)
             : s.kind == BAND                ? 3 * aspect
                                             : aspect);
    return s;
}

/* Adds the sign at (cx, cy), turned, to ink_mask and its label to label_mask. */
static void stamp(io_canvas *c, const sign *s, float cx, float cy, float turn, float margin, float *ink_mask,
                  float *label_mask)
{
    const float cosine = cosf(turn), sine = sinf(turn), w = s->half_w + margin, h = s->half_h + margin;
    const float reach_x = nz_abs(cosine) * w + nz_abs(sine) * h + 2 * c->pixel,
                reach_y = nz_abs(sine) * w + nz_abs(cosine) * h + 2 * c->pixel;
    const int x0 = cv_column(c, cx - reach_x), x1 = cv_column(c, cx + reach_x), y0 = cv_row(c, cy + reach_y),
              y1 = cv_row(c, cy - reach_y);
    for (int j = y0; j <= y1; j++)
        for (int i = x0; i <= x1; i++) {
            const int at = j * c->size + i;
            const float px = c->x[at] - cx, py = c->y[at] - cy, x = cosine * px + sine * py,
                        y = cosine * py - sine * px;
            const float border = nz_max(nz_abs(x) - w, nz_abs(y) - h);
            const float inked = nz_max(ink(s, x, y), nz_max(nz_abs(x) - s->half_w, nz_abs(y) - s->half_h) - c->pixel);
            ink_mask[at] = nz_max(ink_mask[at], nz_clamp(0.5f - inked * c->width, 0, 1));
            label_mask[at] = nz_max(label_mask[at], nz_clamp(0.5f - border * c->width, 0, 1));
        }
}

void wear_decals(io_canvas *c)
{
    const int mark = c->used, count = 1 + (cv_chance(c, 0.4f) ? ts_rng_int(&c->rng, 5) : 0);
    float *inked = cv_plane(c), *label = cv_plane(c);
    for (int i = 0; i < c->count; i++) inked[i] = label[i] = 0;
    io_rgb colour;
    pal_paint(c, colour);
    const io_substance print = pal_dielectric(c, colour, cv_range(c, 0.15f, 0.9f));
    pal_paint(c, colour);
    const io_substance paper = pal_dielectric(c, colour, cv_range(c, 0.15f, 0.8f));
    const bool on_label = cv_chance(c, 0.45f);
    const float level = cv_chance(c, 0.6f) ? 0.25f * (float)ts_rng_int(&c->rng, 4) : cv_range(c, 0, 1),
                margin = cv_range(c, 0.005f, 0.04f);
    for (int k = 0; k < count; k++) {
        const sign s = draw_sign(c);
        const float x = cv_range(c, -0.45f, 0.45f), y = cv_range(c, -0.45f, 0.45f), loose = cv_range(c, -0.01f, 0.01f);
        stamp(c, &s, x, y, (level + loose) * 6.2831853f, margin, inked, label);
    }
    /* Rubbed off in patches, most of it or nearly nothing. */
    nz_frame f = cv_frame(c, cv_log_range(c, 2, 10), 1, 0);
    const float gain = cv_range(c, 0.5f, 0.8f), gone = cv_chance(c, 0.5f) ? 0.01f : cv_range(c, 0.02f, 0.5f);
    float *left = cv_noise(c, f, NZ_SMOOTH, 1, 6, gain);
    for (int i = 0; i < c->count; i++) left[i] = -left[i];
    cv_threshold(c, left, -cv_level(gone), 0.15f);
    for (int i = 0; i < c->count; i++) {
        inked[i] *= left[i];
        label[i] *= left[i];
    }
    const float opaque = cv_range(c, 0.6f, 1), thick = cv_log_range(c, 0.0001f, 0.0015f);
    if (on_label) {
        cv_cover(c, label, opaque, &paper);
        cv_raise(c, label, thick);
    }
    cv_cover(c, inked, opaque, &print);
    cv_raise(c, inked, 0.3f * thick);
    cv_drop(c, mark);
}
