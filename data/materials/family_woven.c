/* Cloth with real crossings: threads that run over and under each other, each of its own tint and height. */
#include "data/materials/family.h"
#include "data/materials/finish.h"

/* Bit i of row j: the warp lies on top where warp thread i crosses weft thread j, modulo 8. */
static const uint8_t weaves[][8] = {
    {0x55, 0xaa, 0x55, 0xaa, 0x55, 0xaa, 0x55, 0xaa}, /* plain */
    {0x33, 0x66, 0xcc, 0x99, 0x33, 0x66, 0xcc, 0x99}, /* twill, 2 over 2 */
    {0x77, 0xee, 0xdd, 0xbb, 0x77, 0xee, 0xdd, 0xbb}, /* denim, 3 over 1 */
    {0x11, 0x22, 0x44, 0x88, 0x11, 0x22, 0x44, 0x88}, /* 1 over 3 */
    {0xfe, 0xf7, 0xbf, 0xfd, 0xef, 0x7f, 0xfb, 0xdf}, /* satin of 8 */
    {0x33, 0x33, 0xcc, 0xcc, 0x33, 0x33, 0xcc, 0xcc}, /* basket */
    {0x33, 0x66, 0xcc, 0x99, 0xcc, 0x66, 0x33, 0x99}, /* herringbone */
    {0x0f, 0x0f, 0x0f, 0x0f, 0xf0, 0xf0, 0xf0, 0xf0}, /* basket of four */
    {0x55, 0xaa, 0x55, 0xaa, 0x7d, 0xee, 0xd7, 0xaa}, /* honeycomb */
};

typedef struct cloth {
    const uint8_t *weave;
    float warp, weft;  /* half widths of threads, of their spacing */
    float wave, round; /* how far a thread rises and sinks, how thick it is */
    float twist;       /* depth of the fibres' spiral */
    uint32_t seed;
} cloth;

/* -1 .. 1: how high thread "thread" rides at place t along itself, smooth between its crossings. */
static inline float ride(const cloth *w, bool warp, int thread, float t)
{
    const float base = nz_floor(t - 0.5f), p = t - 0.5f - base;
    const int j = (int)base;
    int a, b;
    if (warp) a = w->weave[j & 7] >> (thread & 7) & 1, b = w->weave[(j + 1) & 7] >> (thread & 7) & 1;
    else a = !(w->weave[thread & 7] >> (j & 7) & 1), b = !(w->weave[thread & 7] >> ((j + 1) & 7) & 1);
    return (float)(2 * a - 1) + (float)(2 * (b - a)) * p * p * (3 - 2 * p);
}

/* Heights of the upper thread; which receives its number in [0, 1), top 1 for warp and 0 for weft. */
static void weave(const io_canvas *c, nz_frame f, const cloth *w, float *height, float *which, float *top)
{
    for (int i = 0; i < c->count; i++) {
        const float uf = nz_floor(f.u[i]), vf = nz_floor(f.v[i]);
        const float x = (2 * (f.u[i] - uf) - 1) / w->warp, y = (2 * (f.v[i] - vf) - 1) / w->weft;
        float a = -2, b = -2;
        if (x > -1 && x < 1) {
            const float p = f.v[i] + 0.7f * x;
            a = w->wave * ride(w, true, (int)uf, f.v[i]) + w->round * (1 - x * x) +
                w->twist * nz_abs(2 * (3 * p - nz_floor(3 * p)) - 1);
        }
        if (y > -1 && y < 1) {
            const float p = f.u[i] + 0.7f * y;
            b = w->wave * ride(w, false, (int)vf, f.u[i]) + w->round * (1 - y * y) +
                w->twist * nz_abs(2 * (3 * p - nz_floor(3 * p)) - 1);
        }
        height[i] = nz_max(nz_max(a, b), -1.3f * w->wave);
        top[i] = a >= b;
        which[i] = nz_unit(a >= b ? nz_hash((int)uf, 0, w->seed) : nz_hash((int)vf, 1, w->seed));
    }
}

/* Rows of loops: two slanting legs for every stitch, each coming out of the row below. purl: lying arcs. */
static void knit(const io_canvas *c, nz_frame f, const cloth *w, bool purl, float *height, float *which, float *top)
{
    for (int i = 0; i < c->count; i++) {
        const float u = purl ? f.v[i] : f.u[i], v = purl ? f.u[i] : f.v[i];
        const float uf = nz_floor(u), a = 2 * nz_abs(u - uf - 0.5f), vf = nz_floor(v);
        float best = -1.3f * w->wave;
        int row = 0;
        for (int k = -1; k <= 1; k++) {
            const float t = v - vf - (float)k - 0.5f * a + 0.25f, x = (a - 0.18f - 0.62f * t) / (0.62f * w->warp);
            if (t < -0.25f || t > 1.25f || x < -1 || x > 1) continue;
            const float p = 3 * (t + 0.3f * x), bow = 1 - 4 * (t - 0.5f) * (t - 0.5f);
            const float h = w->wave * (bow + 0.25f * t) + w->round * (1 - x * x) +
                w->twist * nz_abs(2 * (p - nz_floor(p)) - 1);
            if (h > best) best = h, row = (int)vf + k;
        }
        height[i] = best;
        top[i] = row & 1;
        which[i] = nz_unit(nz_hash(row, 2, w->seed));
    }
}

/* Threads dyed one by one, in groups, or by their direction. */
static void dye(io_canvas *c, nz_frame f, const float *which, const float *top, bool rows)
{
    const int mark = c->used;
    io_rgb a, b;
    pal_paint(c, a);
    pal_paint(c, b);
    const int dice = ts_rng_int(&c->rng, 5), group = 1 + ts_rng_int(&c->rng, 8),
              of = group + 1 + ts_rng_int(&c->rng, 8);
    float *mask = cv_plane(c), *tone = cv_plane(c);
    const float spread = cv_range(c, 0, 0.5f), share = cv_range(c, 0.1f, 0.6f);
    for (int i = 0; i < c->count; i++) {
        const float at = top[i] > 0.5f && !rows ? f.u[i] : f.v[i];
        int n = (int)nz_floor(at) % of;
        n += n < 0 ? of : 0;
        mask[i] = dice == 0 ? 0
            : dice == 1     ? top[i]
            : dice == 2     ? (float)(n < group)
            : dice == 3     ? which[i] < share
                            : which[i];
        tone[i] = which[i] - 0.5f;
    }
    cv_tint(c, mask, 1, b);
    if (dice == 4) cv_tint(c, top, 0.5f, a);
    cv_shade(c, tone, spread);
    cv_roughen(c, top, cv_chance(c, 0.3f) ? cv_range(c, -0.2f, 0.2f) : 0);
    cv_drop(c, mark);
}

static void folds(io_canvas *c, float steep)
{
    const int mark = c->used;
    const float turns = cv_range(c, 0, 1), stretch = cv_range(c, 1, 4), often = cv_range(c, 0.8f, 3);
    const nz_frame f = cv_bend(c, cv_frame(c, often, stretch, turns), 1, 2, 0.06f);
    float *fold = cv_noise(c, f, cv_chance(c, 0.5f) ? NZ_RIDGED : NZ_SMOOTH, 1, 3, 0.4f);
    cv_raise(c, fold, steep / (6.2831853f * often));
    cv_drop(c, mark);
}

static void cloth_of(io_canvas *c, bool knitted)
{
    static const uint32_t fibre[] = {0xe4e0d4, 0xb5aa94, 0x8c8c8a, 0x4a4b4d, 0x232324,
                                     0x2d3a4c, 0x7d3f35, 0x6b4a3a, 0x3c4a3a};
    const io_substance yarn = fin_dielectric(c, fibre, PAL_COUNT(fibre), 0.45f, 1);
    cv_fill(c, &yarn);
    const float threads = knitted ? cv_log_range(c, 6, 28) : cv_log_range(c, 6, 44), unit = 1 / threads;
    const float turns = cv_chance(c, 0.5f) ? cv_range(c, -0.02f, 0.02f) : cv_range(c, 0, 1),
                stretch = knitted ? cv_range(c, 0.6f, 1)
        : cv_chance(c, 0.6f)      ? 1
                                  : cv_range(c, 0.6f, 1.6f);
    const nz_frame straight = cv_frame(c, threads, stretch, turns);
    const float sway = cv_log_range(c, 0.05f, 0.4f), often = 3 / threads;
    const nz_frame slow = cv_bend(c, straight, often, 2, sway);
    const float slub = cv_range(c, 0.01f, 0.12f);
    const nz_frame f = cv_bend(c, slow, 0.6f, 2, slub);
    cloth w = {.weave = weaves[ts_rng_int(&c->rng, PAL_COUNT(weaves))]};
    w.warp = cv_range(c, 0.75f, 1.1f);
    w.weft = cv_range(c, 0.75f, 1.1f);
    w.wave = cv_range(c, 0.1f, 0.35f);
    w.round = cv_range(c, 0.25f, 0.8f);
    w.twist = cv_chance(c, 0.6f) ? cv_range(c, 0.02f, 0.15f) * nz_smooth(0.12f, 0.05f, f.step) : 0;
    w.seed = cv_seed(c);
    float *height = cv_plane(c), *which = cv_plane(c), *top = cv_plane(c);
    if (knitted) knit(c, f, &w, cv_chance(c, 0.3f), height, which, top);
    else weave(c, f, &w, height, which, top);
    cv_raise(c, height, 0.5f * unit);
    if (cv_chance(c, 0.75f)) dye(c, f, which, top, knitted);
    fin_relief(c, 0.07f, 0.35f);
    if (cv_chance(c, 0.35f)) folds(c, cv_log_range(c, 0.03f, 0.2f));
    fin_any(c, 0.12f, 0.03f);
}

void io_family_woven(io_canvas *c) { cloth_of(c, false); }

void io_family_knitted(io_canvas *c) { cloth_of(c, true); }
