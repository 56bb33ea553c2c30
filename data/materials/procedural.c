#include "data/materials/procedural.h"
#include "data/materials/blend.h"
#include "data/materials/collected.h"
#include "data/materials/darker.h"
#include "data/materials/family.h"
#include "data/materials/homogeneous.h"
#include "data/materials/hues.h"
#include "data/materials/plain.h"
#include "data/materials/relief.h"
#include "data/materials/smoother.h"
#include "data/materials/steeper.h"
#include "data/materials/uneven.h"
#include "tensor/scratch.h"
#include <math.h>
#include <stdio.h>
#include <string.h>

#define MOST_CLOSER 4.0f
enum {
    CLASSIC = 17
}; /* the first so many families are finished by wear_calm, of two that are mixed where
     the first is one of them; the others by fin_any */

/* Every family: its key, how often it is drawn beside the others, and what it paints. */
static const struct {
    const char *name;
    float weight;
    void (*paint)(io_canvas *c);
} families[] = {
    {"stone", 1, io_family_stone},        {"marble", 0.8f, io_family_marble},
    {"brick", 0.8f, io_family_brick},     {"paving", 0.8f, io_family_paving},
    {"tile", 1, io_family_tile},          {"wood", 1, io_family_wood},
    {"cloth", 0.8f, io_family_cloth},     {"leather", 0.8f, io_family_leather},
    {"brushed", 1, io_family_brushed},    {"rust", 1, io_family_rust},
    {"plaster", 0.7f, io_family_plaster}, {"concrete", 0.7f, io_family_concrete},
    {"ground", 0.8f, io_family_ground},   {"paint", 1, io_family_paint},
    {"panels", 1.2f, io_family_panels},   {"embossed", 1, io_family_embossed},
    {"plastic", 0.7f, io_family_plastic}, {"masonry", 1, io_family_masonry},
    {"cobbles", 1, io_family_cobbles},    {"woven", 1.2f, io_family_woven},
    {"knitted", 0.7f, io_family_knitted}, {"hide", 1.2f, io_family_hide},
    {"scales", 0.7f, io_family_scales},   {"rough", 2, io_family_rough},
    {"foam", 0.7f, io_family_foam},       {"polished", 1.5f, io_family_polished},
    {"alloy", 1.8f, io_family_alloy},     {"bark", 1, io_family_bark},
    {"pebbles", 1.2f, io_family_pebbles}, {"creased", 1.2f, io_family_creased},
    {"stamped", 1, io_family_stamped},    {"granite", 1, io_family_granite},
    {"printed", 1, io_family_printed},    {"faces", 1.2f, io_family_faces},
    {"pierced", 0.7f, io_family_pierced}, {"lattice", 0.8f, io_family_lattice},
};

int io_family_count(void) { return (int)(sizeof families / sizeof *families); }

const char *io_family_name(int family)
{
    return family >= 0 && family < io_family_count() ? families[family].name : "none";
}

int io_family_find(const char *name)
{
    for (int i = 0; i < io_family_count(); i++)
        if (!strcmp(families[i].name, name)) return i;
    return -1;
}

uint64_t io_family_mask(const char *name)
{
    if (!strcmp(name, "all")) return (UINT64_C(1) << io_family_count()) - 1;
    if (!strcmp(name, "classic")) return (UINT64_C(1) << CLASSIC) - 1;
    const int family = io_family_find(name);
    return family < 0 ? 0 : UINT64_C(1) << family;
}

static float weight(int family, uint64_t often) { return families[family].weight * (often >> family & 1 ? 3 : 1); }

static int draw_family(ts_rng *rng, uint64_t allowed, uint64_t often)
{
    float total = 0;
    int last = 0;
    for (int i = 0; i < io_family_count(); i++)
        if (allowed >> i & 1) total += weight(i, often);
    float u = ts_rng_uniform(rng) * total;
    for (int i = 0; i < io_family_count(); i++) {
        if (!(allowed >> i & 1)) continue;
        last = i;
        u -= weight(i, often);
        if (u < 0) break;
    }
    return last;
}

/* Points c at the eight painted planes that begin at base. */
static void painted_at(io_canvas *c, float *base)
{
    size_t n = (size_t)c->count;
    c->height = base;
    for (int k = 0; k < 3; k++) {
        c->diffuse[k] = base + (size_t)(1 + k) * n;
        c->specular[k] = base + (size_t)(4 + k) * n;
    }
    c->roughness = base + 7 * n;
}

/* Two materials of one patch: side by side with a ragged border, one showing through where it lies higher, the colours
 * or the gloss of one on the relief of the other, or laid over each other faintly. base holds the first, c's painted
 * planes the second; the result goes to c. */
static void mix(io_canvas *c, const float *base)
{
    enum { BESIDE, BY_HEIGHT, COLOURS, GLOSS, FAINT } how;
    int mark = c->used;
    float *mask = cv_plane(c);
    size_t n = (size_t)c->count;
    int dice = ts_rng_int(&c->rng, 12);
    how = dice < 4 ? BESIDE : dice < 7 ? BY_HEIGHT : dice < 9 ? COLOURS : dice < 11 ? GLOSS : FAINT;
    nz_frame f = cv_bend(c, cv_frame(c, 1, 1, 0), 3, 3, 0.015f);
    uint32_t seed = cv_seed(c);
    float gain = cv_range(c, 0.35f, 0.6f), frequency = cv_log_range(c, 0.5f, 3);
    nz_fbm(f, NZ_SMOOTH, frequency, 6, gain, seed, mask);
    if (how == BY_HEIGHT) { /* by height, as sand between stones */
        float *smooth = cv_cavity(c, 0.08f);
        for (int i = 0; i < c->count; i++) mask[i] = 0.4f * mask[i] - 1.6f * smooth[i];
    }
    float blur = cv_log_range(c, 0.03f, 0.5f), coverage = cv_range(c, 0.25f, 0.75f);
    cv_threshold(c, mask, cv_level(coverage), blur);
    float share = how == FAINT ? cv_range(c, 0.3f, 0.7f) : 1;
    for (int i = 0; i < c->count; i++) {
        float t = how == FAINT ? share : mask[i], relief = how <= BY_HEIGHT ? t : 0;
        float colour = how == COLOURS ? 1 : how == GLOSS ? 0 : t, gloss = how == COLOURS || how == GLOSS ? 1 : t;
        c->height[i] = nz_mix(base[i], c->height[i], relief);
        for (int k = 0; k < 3; k++) {
            c->diffuse[k][i] = nz_mix(base[(size_t)(1 + k) * n + (size_t)i], c->diffuse[k][i], colour);
            c->specular[k][i] = nz_mix(base[(size_t)(4 + k) * n + (size_t)i], c->specular[k][i], colour);
        }
        c->roughness[i] = nz_mix(base[7 * n + (size_t)i], c->roughness[i], gloss);
    }
    cv_drop(c, mark);
}

/* Material number index, painted on c, becomes a mean of itself and another; base has room for that. */
static void blend(const io_procedural *p, uint64_t index, uint64_t allowed, io_canvas *c, float *base)
{
    ts_rng rng = ts_rng_make(p->seed, TS_STREAM_BLEND, index);
    if (ts_rng_uniform(&rng) >= p->blend) return;
    const float weight = 0.1f + 0.8f * ts_rng_uniform(&rng);
    io_canvas other = *c;
    painted_at(&other, base);
    other.rng = rng;
    families[draw_family(&other.rng, allowed, p->often)].paint(&other);
    cv_blend(c, &other, weight);
}

/* Material number index, painted on c, gets another relief; base has room for a second material. */
static void exchange_relief(const io_procedural *p, uint64_t index, uint64_t allowed, io_canvas *c, float *base)
{
    c->rng = ts_rng_make(p->seed, TS_STREAM_RELIEF, index);
    if (!cv_chance(c, p->relief)) return;
    const cv_relief relief = cv_draw_relief(c);
    io_canvas other = *c;
    painted_at(&other, base);
    if (relief.exchanged) families[draw_family(&other.rng, allowed, p->often)].paint(&other);
    c->rng = other.rng;
    cv_other_relief(c, &relief, other.height, other.roughness);
}

static void make_plain(const io_procedural *p, uint64_t index, io_canvas *c)
{
    c->rng = ts_rng_make(p->seed, TS_STREAM_PLAIN, index);
    if (cv_chance(c, p->plain)) cv_plain(c);
}

static void make_uneven(const io_procedural *p, uint64_t index, io_canvas *c)
{
    c->rng = ts_rng_make(p->seed, TS_STREAM_UNEVEN, index);
    if (cv_chance(c, p->uneven)) cv_uneven(c);
}

static void make_homogeneous(const io_procedural *p, uint64_t index, io_canvas *c)
{
    c->rng = ts_rng_make(p->seed, TS_STREAM_HOMOGENEOUS, index);
    if (cv_chance(c, p->homogeneous)) cv_homogeneous(c);
}

/* How much of the patch is seen. */
static void look(const io_procedural *p, uint64_t index, io_canvas *c)
{
    c->rng = ts_rng_make(p->seed, TS_STREAM_CLOSER, index);
    const bool closer = cv_chance(c, p->closer);
    const float times = closer ? cv_log_range(c, 1, MOST_CLOSER) : 1, x = cv_range(c, -0.5f, 0.5f),
                y = cv_range(c, -0.5f, 0.5f);
    cv_view(c, times, x, y);
}

/* A part of a map set, with its number for a name. False: this material is none. */
static bool collect(const io_procedural *p, uint64_t index, io_canvas *c, char *name, size_t length)
{
    c->rng = ts_rng_make(p->seed, TS_STREAM_COLLECTED, index);
    if (!p->collection || !cv_chance(c, p->collected)) return false;
    const int number = ts_rng_int(&c->rng, io_collection_count(p->collection));
    cv_collected(c, io_collection_get(p->collection, number));
    snprintf(name, length, "%05llu_collected_%d", (unsigned long long)index, number);
    return true;
}

/* One family, or two mixed, on c, whose painted planes begin at first and, of two mixed, at second (true). */
static bool paint(const io_procedural *p, uint64_t index, uint64_t allowed, io_canvas *c, float *first, float *second,
                  char *name, size_t length)
{
    c->rng = ts_rng_make(p->seed, TS_STREAM_MATERIAL, index);
    const int a = draw_family(&c->rng, allowed, p->often), b = draw_family(&c->rng, allowed, p->often);
    const bool mixed = cv_chance(c, 0.27f);
    families[a].paint(c);
    if (mixed) {
        c->used = 0;
        painted_at(c, second);
        families[b].paint(c);
        c->used = 0;
        mix(c, first);
    }
    c->used = 0;
    if (a < CLASSIC) wear_calm(c);
    snprintf(name, length, mixed ? "%05llu_%s_%s" : "%05llu_%s", (unsigned long long)index, families[a].name,
             families[b].name);
    return mixed;
}

void io_procedural_make(const io_procedural *p, uint64_t index, io_material *m)
{
    io_canvas c = {.size = m->size, .count = m->size * m->size};
    size_t n = (size_t)c.count;
    float *memory = ts_scratch(TS_SCRATCH_SLOTS - 1, (CANVAS_ALL + CANVAS_PAINTED) * n * sizeof *memory);
    c.x = memory;
    c.y = memory + n;
    float *first = memory + 2 * n, *second = first + CANVAS_PAINTED * n;
    c.planes = second + CANVAS_PAINTED * n;
    look(p, index, &c);
    const uint64_t all = io_family_mask("all"), allowed = p->families & all ? p->families & all : all;
    painted_at(&c, first);
    float *other = second; /* room for another material */
    if (!collect(p, index, &c, m->name, sizeof m->name) &&
        paint(p, index, allowed, &c, first, second, m->name, sizeof m->name))
        other = first;
    c.used = 0;
    blend(p, index, allowed, &c, other);
    c.used = 0;
    exchange_relief(p, index, allowed, &c, other);
    c.used = 0;
    ts_rng steeper = ts_rng_make(p->seed, TS_STREAM_STEEPER, index);
    if (ts_rng_uniform(&steeper) < p->steeper) cv_steeper(&c, &steeper);
    make_plain(p, index, &c);
    make_uneven(p, index, &c);
    c.used = 0;
    make_homogeneous(p, index, &c);
    ts_rng hues = ts_rng_make(p->seed, TS_STREAM_HUES, index);
    if (ts_rng_uniform(&hues) < p->hues) cv_other_hues(&c, &hues);
    ts_rng darker = ts_rng_make(p->seed, TS_STREAM_DARKER, index);
    if (ts_rng_uniform(&darker) < p->darker) cv_darker(&c, &darker);
    ts_rng smoother = ts_rng_make(p->seed, TS_STREAM_SMOOTHER, index);
    if (ts_rng_uniform(&smoother) < p->smoother) cv_smoother(&c, &smoother);
    cv_write(&c, m->maps);
}
