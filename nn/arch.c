/* The architecture's fields in one table: default, range, key. */
#include "nn/arch_fields.h"
#include "nn/layers.h"
#include "tensor/maps.h"
#include <stddef.h>
#include <string.h>

static const char *const rmse_words[] = {"start", "batch"}, *const encoding_words[] = {"raw", "asinh"},
                         *const compat_words[] = {"none", "published"};
static const char *const descent_words[] = {"none", "gradient", "newton", "posterior"};
_Static_assert(sizeof(nn_rmse) == sizeof(int) && sizeof(nn_compat) == sizeof(int) &&
                   sizeof(nn_gradient) == sizeof(int) && sizeof(nn_descent) == sizeof(int),
               "a word's field is read and written as an int");

/* The upper bounds keep products of sizes far from overflow. The defaults are a model that two cores can train. */
#define AT(member) offsetof(nn_arch, member)
const nn_arch_field nn_arch_fields[NN_ARCH_FIELDS] = {
    {"channels", FIELD_INT, AT(channels), 9, 10, 9, NULL, false},
    {"g_width", FIELD_INT, AT(g_width), 1, 4096, 16, NULL, false},
    {"g_width_max", FIELD_INT, AT(g_width_max), 1, 4096, 128, NULL, false},
    {"g_levels", FIELD_INT, AT(g_levels), 1, NN_MAX_LEVELS, 5, NULL, false},
    {"g_kernel_first", FIELD_INT, AT(g_kernel_first), 1, 15, 3, NULL, false},
    {"g_kernel", FIELD_INT, AT(g_kernel), 1, 15, 3, NULL, false},
    {"g_size", FIELD_INT, AT(g_size), 2, 8192, 64, NULL, false},
    {"h_width", FIELD_INT, AT(h_width), 0, 4096, 64, NULL, false},
    {"h_gru", FIELD_INT, AT(h_gru), 1, 1024, 32, NULL, false},
    {"iterations", FIELD_INT, AT(iterations), 0, 1000, 6, NULL, false},
    {"recurrent", FIELD_BOOL, AT(recurrent), 0, 1, true, NULL, false},
    {"gradient", FIELD_BOOL, AT(gradient), 0, 1, true, NULL, false},
    {"descent", FIELD_WORD, AT(descent), NN_DESCENT_NONE, NN_DESCENT_POSTERIOR, NN_DESCENT_NEWTON, descent_words,
     false},
    {"mean_before_norm", FIELD_BOOL, AT(mean_before_norm), 0, 1, true, NULL, false},
    {"rmse", FIELD_WORD, AT(rmse), NN_RMSE_START, NN_RMSE_BATCH, NN_RMSE_START, rmse_words, false},
    {"encoding", FIELD_WORD, AT(encoding), NN_GRADIENT_RAW, NN_GRADIENT_ASINH, NN_GRADIENT_ASINH, encoding_words,
     false},
    {.key = "images", .kind = FIELD_INT, .at = AT(images), .lo = 1, .hi = NN_MAX_IMAGES, .start = 1, .late = true},
    {.key = "unshuffle", .kind = FIELD_INT, .at = AT(g_unshuffle), .lo = 1, .hi = 8, .start = 1, .late = true},
    {.key = "g_detail", .kind = FIELD_INT, .at = AT(g_detail), .lo = 1, .hi = 1024, .start = 64, .late = true},
    {.key = "g_trunk", .kind = FIELD_INT, .at = AT(g_trunk), .lo = 0, .hi = NN_MAX_LEVELS, .late = true},
    {.key = "g_half", .kind = FIELD_INT, .at = AT(g_half), .lo = 0, .hi = 1024, .late = true},
    {.key = "conditions", .kind = FIELD_BOOL, .at = AT(conditions), .hi = 1, .late = true},
    {.key = "spread", .kind = FIELD_BOOL, .at = AT(spread), .hi = 1, .late = true},
    {.key = "scene", .kind = FIELD_BOOL, .at = AT(scene), .hi = 1, .late = true},
    {.key = "compat",
     .kind = FIELD_WORD,
     .at = AT(compat),
     .hi = NN_COMPAT_PUBLISHED,
     .words = compat_words,
     .late = true},
    {.key = "coarse_steps", .kind = FIELD_INT, .at = AT(coarse_steps), .hi = 1000, .late = true},
    {.key = "coarse_size", .kind = FIELD_INT, .at = AT(coarse_size), .lo = 1, .hi = 8192, .start = 128, .late = true},
    {.key = "coarse_width", .kind = FIELD_INT, .at = AT(coarse_width), .lo = 1, .hi = 4096, .start = 128, .late = true},
    {.key = "coarse_gru", .kind = FIELD_INT, .at = AT(coarse_gru), .lo = 1, .hi = 1024, .start = 64, .late = true},
    {.key = "revisions", .kind = FIELD_INT, .at = AT(revisions), .hi = 16, .late = true},
    {.key = "revise_width", .kind = FIELD_INT, .at = AT(revise_width), .lo = 4, .hi = 1024, .start = 64, .late = true},
};

int nn_arch_get(const nn_arch *a, const nn_arch_field *f)
{
    const void *p = (const char *)a + f->at;
    if (f->kind == FIELD_BOOL) return *(const bool *)p;
    int v;
    memcpy(&v, p, sizeof v);
    return v;
}

void nn_arch_set(nn_arch *a, const nn_arch_field *f, int v)
{
    void *p = (char *)a + f->at;
    if (f->kind == FIELD_BOOL) *(bool *)p = v != 0;
    else memcpy(p, &v, sizeof v);
}

nn_arch nn_arch_default(void)
{
    nn_arch a;
    memset(&a, 0, sizeof a);
    for (int i = 0; i < NN_ARCH_FIELDS; i++) nn_arch_set(&a, &nn_arch_fields[i], nn_arch_fields[i].start);
    return a;
}

int nn_arch_side(const nn_arch *a) { return a->g_unshuffle * a->g_size; }

int nn_most_photographs(const nn_arch *a) { return a->descent == NN_DESCENT_POSTERIOR ? NN_MAX_IMAGES : a->images; }

bool nn_arch_refines(const nn_arch *a) { return a->coarse_steps > 0 || nn_arch_refines_full(a); }

bool nn_arch_refines_full(const nn_arch *a)
{
    return a->h_width > 0 || (a->iterations > 0 && a->gradient && a->descent != NN_DESCENT_NONE);
}

bool nn_arch_reads(const nn_arch *a) { return a->gradient && (a->h_width > 0 || a->descent == NN_DESCENT_GRADIENT); }

int nn_arch_steps(const nn_arch *a, int photographs)
{
    return a->iterations * (photographs > 1 && a->descent == NN_DESCENT_POSTERIOR ? 2 : 1);
}

int nn_arch_revisions(const nn_arch *a, int photographs, int known, int steps)
{
    if (photographs < 2 || known != NN_KNOWN_ALL) return 0;
    return steps < a->revisions ? steps : a->revisions;
}

bool nn_arch_carries(const nn_arch *a) { return a->recurrent && a->h_width > 0; }

ts_code nn_arch_check(const nn_arch *a, ts_status *st)
{
    for (int i = 0; i < NN_ARCH_FIELDS; i++) {
        const nn_arch_field *f = &nn_arch_fields[i];
        int v = nn_arch_get(a, f);
        if (v < f->lo || v > f->hi)
            return ts_fail(st, TS_INVALID, "%s is %d: it must be %d to %d", f->key, v, f->lo, f->hi);
    }
    if (a->g_width_max < a->g_width)
        return ts_fail(st, TS_INVALID, "g_width_max is %d: it must be at least g_width, %d", a->g_width_max,
                       a->g_width);
    if (a->g_kernel_first % 2 == 0)
        return ts_fail(st, TS_INVALID, "g_kernel_first is %d: it must be odd", a->g_kernel_first);
    if (a->g_kernel % 2 == 0) return ts_fail(st, TS_INVALID, "g_kernel is %d: it must be odd", a->g_kernel);
    if (a->g_size % (1 << a->g_levels) != 0)
        return ts_fail(st, TS_INVALID, "g_size is %d: with %d g_levels it must be a multiple of %d", a->g_size,
                       a->g_levels, 1 << a->g_levels);
    const bool extended = a->g_unshuffle > 1 || a->conditions || a->spread || a->scene;
    if (extended && (a->compat == NN_COMPAT_PUBLISHED || a->channels != MAP_CHANNELS))
        return ts_fail(st, TS_INVALID,
                       "unshuffle, conditions, spread or scene is set: that needs channels 9 and compat = none");
    if (a->g_unshuffle > 1 && a->images > 1)
        return ts_fail(st, TS_INVALID, "unshuffle is %d: that needs images 1", a->g_unshuffle);
    if (a->g_half > 0 && a->g_unshuffle % 2 != 0)
        return ts_fail(st, TS_INVALID, "g_half is %d: that needs an even unshuffle, not %d", a->g_half, a->g_unshuffle);
    if (a->spread && a->g_unshuffle == 1) return ts_fail(st, TS_INVALID, "spread is set: that needs unshuffle above 1");
    if (a->descent == NN_DESCENT_POSTERIOR && (!a->spread || !a->scene || a->coarse_steps > 0 || a->h_width > 0))
        return ts_fail(st, TS_INVALID, "descent is posterior: that needs spread, scene, h_width 0 and coarse_steps 0");
    if (a->revisions > 0 && (a->descent != NN_DESCENT_POSTERIOR || a->g_size % 4 != 0 || a->iterations == 0))
        return ts_fail(st, TS_INVALID,
                       "revisions is %d: that needs descent = posterior, iterations and a g_size that 4 divides",
                       a->revisions);
    if (a->scene && a->images > 1) return ts_fail(st, TS_INVALID, "scene is set: that needs images 1");
    if (a->images > 1 && a->rmse == NN_RMSE_BATCH)
        return ts_fail(st, TS_INVALID, "images is %d: with rmse = batch it must be 1", a->images);
    if (a->compat == NN_COMPAT_PUBLISHED &&
        (a->descent != NN_DESCENT_NONE || a->images > 1 || a->rmse != NN_RMSE_BATCH))
        return ts_fail(st, TS_INVALID, "compat is published: that needs descent = none, rmse = batch and images 1");
    if (a->coarse_steps > 0 && (a->compat == NN_COMPAT_PUBLISHED || a->rmse != NN_RMSE_START))
        return ts_fail(st, TS_INVALID, "coarse_steps is %d: that needs compat = none and rmse = start",
                       a->coarse_steps);
    if (a->coarse_steps > a->iterations)
        return ts_fail(st, TS_INVALID, "coarse_steps is %d: at most all of the %d iterations can be coarse",
                       a->coarse_steps, a->iterations);
    if (a->iterations > a->coarse_steps && !nn_arch_refines_full(a))
        return ts_fail(st, TS_INVALID,
                       "iterations is %d: with h_width 0 and no descent (or no gradient) it must be coarse_steps, %d",
                       a->iterations, a->coarse_steps);
    return TS_OK;
}
