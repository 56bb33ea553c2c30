/* The architecture's fields in one table: default, range, metadata key. */
#include "nn/weights/weights.h"
#include "nn/layers.h"
#include "nn/weights/published.h"
#include "tensor/maps.h"
#include <stddef.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

typedef enum field_kind { FIELD_INT, FIELD_BOOL, FIELD_WORD } field_kind;

typedef struct field {
    const char *key;
    field_kind kind;
    size_t at;
    int lo, hi, start;
    const char *const *words; /* FIELD_WORD: its values' names, lo .. hi */
    bool late;                /* files older than the field do not have it */
} field;

static const char *const rmse_words[] = {"start", "batch"}, *const encoding_words[] = {"raw", "asinh"},
                         *const compat_words[] = {"none", "published"};
static const char *const descent_words[] = {"none", "gradient", "newton", "posterior"};
_Static_assert(sizeof(nn_rmse) == sizeof(int) && sizeof(nn_compat) == sizeof(int) &&
                   sizeof(nn_gradient) == sizeof(int) && sizeof(nn_descent) == sizeof(int),
               "a word's field is read and written as an int");

/* The upper bounds keep products of sizes far from overflow. The defaults are a model that two cores can train. */
#define AT(member) offsetof(nn_arch, member)
static const field fields[] = {
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
};
enum { FIELDS = sizeof fields / sizeof *fields };
_Static_assert(FIELDS + 1 <= NN_ARCH_META, "there is metadata for every field and the format");
static const char prefix[] = "arch.";

static int get(const nn_arch *a, const field *f)
{
    const void *p = (const char *)a + f->at;
    if (f->kind == FIELD_BOOL) return *(const bool *)p;
    int v;
    memcpy(&v, p, sizeof v);
    return v;
}

static void set(nn_arch *a, const field *f, int v)
{
    void *p = (char *)a + f->at;
    if (f->kind == FIELD_BOOL) *(bool *)p = v != 0;
    else memcpy(p, &v, sizeof v);
}

nn_arch nn_arch_default(void)
{
    nn_arch a;
    memset(&a, 0, sizeof a);
    for (int i = 0; i < FIELDS; i++) set(&a, &fields[i], fields[i].start);
    return a;
}

int nn_arch_side(const nn_arch *a) { return a->g_unshuffle * a->g_size; }

bool nn_arch_refines(const nn_arch *a) { return a->coarse_steps > 0 || nn_arch_refines_full(a); }

bool nn_arch_refines_full(const nn_arch *a)
{
    return a->h_width > 0 || (a->iterations > 0 && a->gradient && a->descent != NN_DESCENT_NONE);
}

bool nn_arch_reads(const nn_arch *a) { return a->gradient && (a->h_width > 0 || a->descent == NN_DESCENT_GRADIENT); }

bool nn_arch_carries(const nn_arch *a) { return a->recurrent && a->h_width > 0; }

ts_code nn_arch_check(const nn_arch *a, ts_status *st)
{
    for (int i = 0; i < FIELDS; i++) {
        const field *f = &fields[i];
        int v = get(a, f);
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
    if (a->spread && a->g_unshuffle == 1) return ts_fail(st, TS_INVALID, "spread is set: that needs unshuffle above 1");
    if (a->descent == NN_DESCENT_POSTERIOR && (!a->spread || !a->scene || a->coarse_steps > 0 || a->h_width > 0))
        return ts_fail(st, TS_INVALID, "descent is posterior: that needs spread, scene, h_width 0 and coarse_steps 0");
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

static const char *value_text(const nn_arch *a, const field *f, char *text, size_t size)
{
    int v = get(a, f);
    if (f->kind == FIELD_BOOL) snprintf(text, size, "%s", v ? "true" : "false");
    else if (f->kind == FIELD_WORD) snprintf(text, size, "%s", f->words[v]);
    else snprintf(text, size, "%d", v);
    return text;
}

int nn_arch_to_meta(const nn_arch *arch, nn_meta *meta, int capacity, char *text, size_t text_size)
{
    size_t used = 0;
    int n = 0;
    if (capacity < 1) return -1;
    meta[n++] = (nn_meta){"format", "lgd"};
    for (int i = 0; i < FIELDS; i++) {
        if (fields[i].late && get(arch, &fields[i]) == fields[i].start) continue;
        char value[16], both[64];
        value_text(arch, &fields[i], value, sizeof value);
        int key = snprintf(both, sizeof both, "%s%s", prefix, fields[i].key) + 1;
        int all = key + snprintf(both + key, sizeof both - (size_t)key, "%s", value) + 1;
        if (n == capacity || used + (size_t)all > text_size) return -1;
        memcpy(text + used, both, (size_t)all);
        meta[n++] = (nn_meta){text + used, text + used + key};
        used += (size_t)all;
    }
    return n;
}

static bool parse(const field *f, const char *text, int *v)
{
    if (f->kind == FIELD_BOOL) {
        *v = !strcmp(text, "true");
        return *v || !strcmp(text, "false");
    }
    if (f->kind == FIELD_WORD) {
        for (*v = f->lo; *v <= f->hi; ++*v)
            if (!strcmp(text, f->words[*v])) return true;
        return false;
    }
    size_t n = strlen(text);
    if (n < 1 || n > 9 || strspn(text, "0123456789") != n) return false; /* nine digits fit an int */
    *v = atoi(text);
    return true;
}

ts_code nn_arch_from_file(const nn_file *file, nn_arch *arch, ts_status *st)
{
    const char *format = nn_file_meta(file, "format"), *key;
    memset(arch, 0, sizeof *arch);
    if (format && strcmp(format, NN_CODER_FORMAT) == 0)
        return ts_fail(st, TS_UNSUPPORTED, "%s: is an auto-encoder of maps, not a network that reads a photograph",
                       nn_file_path(file));
    if (!format || strcmp(format, "lgd") != 0) {
        if (nn_published_file(file)) return nn_published_arch(file, arch, st);
        return ts_fail(st, TS_FORMAT,
                       "%s: metadata key \"format\" is %.40s, not \"lgd\", and the tensors are not the published "
                       "network's: these are not weights of this program",
                       nn_file_path(file), format ? format : "missing");
    }
    for (int i = 0; (key = nn_file_meta_key(file, i)) != NULL; i++) {
        bool known = strncmp(key, prefix, sizeof prefix - 1) != 0;
        for (int j = 0; j < FIELDS && !known; j++) known = !strcmp(key + sizeof prefix - 1, fields[j].key);
        if (!known)
            return ts_fail(st, TS_UNSUPPORTED,
                           "%s: metadata key \"%.80s\" is not known: the file needs another version of this program",
                           nn_file_path(file), key);
    }
    for (int i = 0; i < FIELDS; i++) {
        char name[64];
        int v;
        snprintf(name, sizeof name, "%s%s", prefix, fields[i].key);
        const char *text = nn_file_meta(file, name);
        if (!text && fields[i].late) {
            set(arch, &fields[i], fields[i].start);
            continue;
        }
        if (!text) return ts_fail(st, TS_FORMAT, "%s: metadata key \"%s\" is missing", nn_file_path(file), name);
        if (!parse(&fields[i], text, &v))
            return ts_fail(st, TS_FORMAT, "%s: metadata key \"%s\" is \"%.40s\": not a value of it", nn_file_path(file),
                           name, text);
        set(arch, &fields[i], v);
    }
    if (nn_arch_check(arch, st)) return ts_context(st, "%s: architecture", nn_file_path(file));
    return TS_OK;
}
