/* Reading, checking and printing a configuration by the table of keys. */
#include "train/config.h"
#include "data/ini.h"
#include "tensor/maps.h"
#include "tensor/plain_locale.h"
#include <errno.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>
#include <strings.h>

static bool parse_real(const char *text, double *value)
{
    const locale_t before = ts_locale_plain();
    char *end;
    *value = strtod(text, &end);
    ts_locale_back(before);
    return end != text && !*end && *text != ' ';
}

static bool parse_integer(const char *text, int64_t *value)
{
    char *end;
    errno = 0;
    *value = strtoll(text, &end, 10);
    return end != text && !*end && !errno && *text != ' ';
}

static bool parse_bool(const char *text, bool *value)
{
    static const char *const words[2][4] = {{"no", "false", "off", "0"}, {"yes", "true", "on", "1"}};
    for (int v = 0; v < 2; v++)
        for (int i = 0; i < 4; i++)
            if (!strcasecmp(text, words[v][i])) {
                *value = v;
                return true;
            }
    return false;
}

/* Edit distance, for suggestions only: long words are cut. */
static int distance(const char *a, const char *b)
{
    enum { LONGEST = 32 };
    int row[LONGEST + 1];
    const int n = (int)strnlen(a, LONGEST), m = (int)strnlen(b, LONGEST);
    for (int j = 0; j <= m; j++) row[j] = j;
    for (int i = 1; i <= n; i++) {
        int corner = row[0];
        row[0] = i;
        for (int j = 1; j <= m; j++) {
            const int above = row[j], change = corner + (a[i - 1] != b[j - 1]);
            const int step = (above < row[j - 1] ? above : row[j - 1]) + 1;
            row[j] = change < step ? change : step;
            corner = above;
        }
    }
    return row[m];
}

/* Names or groups, removed by "-name", in any order after it. */
static ts_code parse_families(const char *where, const char *key, const char *text, uint64_t *mask, ts_status *st)
{
    const int count = io_family_count();
    uint64_t bits = 0;
    for (const char *p = text; *p;) {
        char word[64];
        const size_t skip = strspn(p, " \t,"), n = strcspn(p + skip, " \t,");
        p += skip;
        if (!n) break;
        if (n >= sizeof word) return ts_fail(st, TS_INVALID, "%s: data.%s: \"%.60s\" is no family", where, key, p);
        memcpy(word, p, n);
        word[n] = 0;
        p += n;
        const bool remove = word[0] == '-';
        const char *name = word + remove;
        const uint64_t named = io_family_mask(name);
        if (!named) {
            int best = 0;
            for (int i = 1; i < count; i++)
                if (distance(name, io_family_name(i)) < distance(name, io_family_name(best))) best = i;
            return ts_fail(st, TS_INVALID, "%s: data.%s: there is no family %s, did you mean %s?", where, key, name,
                           io_family_name(best));
        }
        bits = remove ? bits & ~named : bits | named;
    }
    if (!bits) return ts_fail(st, TS_INVALID, "%s: data.%s names no family that may be drawn", where, key);
    *mask = bits == io_family_mask("all") ? 0 : bits;
    return TS_OK;
}

static ts_code bad_value(const char *where, const tr_key *k, const char *value, ts_status *st)
{
    switch (k->type) {
    case TR_INT:
    case TR_INT64:
        return ts_fail(st, TS_INVALID, "%s: %s.%s must be an integer from %.0f to %.0f, not \"%.60s\"", where,
                       k->section, k->key, k->lo, k->hi, value);
    case TR_REAL:
        return ts_fail(st, TS_INVALID, "%s: %s.%s must be a number from %g to %g, not \"%.60s\"", where, k->section,
                       k->key, k->lo, k->hi, value);
    case TR_BOOL:
        return ts_fail(st, TS_INVALID, "%s: %s.%s must be yes or no, not \"%.60s\"", where, k->section, k->key, value);
    default: break;
    }
    char names[256] = "";
    for (int i = 0; k->choice && k->choice[i]; i++) {
        const size_t n = strlen(names);
        snprintf(names + n, sizeof names - n, "%s%s", i ? ", " : "", k->choice[i]);
    }
    return ts_fail(st, TS_INVALID, "%s: %s.%s must be one of %s, not \"%.60s\"", where, k->section, k->key, names,
                   value);
}

static ts_code set_text(char *to, const char *where, const tr_key *k, const char *value, ts_status *st)
{
    if (strlen(value) >= (size_t)k->hi)
        return ts_fail(st, TS_INVALID, "%s: %s.%s is longer than %.0f bytes", where, k->section, k->key, k->hi - 1);
    /* What an INI file could not say again must not get in by --set. */
    if (strpbrk(value, "\r\n") || (io_ini_needs_quotes(value) && strchr(value, '"')))
        return ts_fail(st, TS_INVALID,
                       "%s: %s.%s must not contain a line break, nor a quotation mark at its beginning or beside a "
                       "comment's sign",
                       where, k->section, k->key);
    strcpy(to, value);
    return TS_OK;
}

static ts_code set_value(tr_config *c, const char *where, const tr_key *k, const char *value, ts_status *st)
{
    char *at = (char *)c + k->offset;
    int64_t i;
    double r;
    switch (k->type) {
    case TR_INT:
    case TR_INT64:
        if (!parse_integer(value, &i) || (double)i < k->lo || (double)i > k->hi) return bad_value(where, k, value, st);
        if (k->type == TR_INT) *(int *)(void *)at = (int)i;
        else *(int64_t *)(void *)at = i;
        return TS_OK;
    case TR_REAL:
        if (!parse_real(value, &r) || !(r >= k->lo && r <= k->hi)) return bad_value(where, k, value, st);
        *(double *)(void *)at = r;
        return TS_OK;
    case TR_BOOL: return parse_bool(value, (bool *)at) ? TS_OK : bad_value(where, k, value, st);
    case TR_CHOICE:
        for (int n = 0; k->choice[n]; n++)
            if (!strcmp(value, k->choice[n])) {
                memcpy(at, &n, sizeof n);
                return TS_OK;
            }
        return bad_value(where, k, value, st);
    case TR_FAMILIES: return parse_families(where, k->key, value, (uint64_t *)(void *)at, st);
    case TR_TEXT: break;
    }
    return set_text(at, where, k, value, st);
}

tr_config tr_config_default(void)
{
    tr_config c;
    memset(&c, 0, sizeof c);
    c.arch = nn_arch_default();
    for (int i = 0; i < tr_key_count; i++)
        if (tr_keys[i].initial) set_value(&c, "default", &tr_keys[i], tr_keys[i].initial, NULL);
    return c;
}

static ts_code unknown(const char *where, const char *section, const char *key, ts_status *st)
{
    const tr_key *near = NULL;
    int least = 0;
    bool known = false;
    for (int i = 0; i < tr_key_count; i++) {
        const tr_key *k = &tr_keys[i];
        known |= !strcmp(k->section, section);
        /* The right key in the wrong section comes before a similar key. */
        const int d = 2 * distance(key, k->key) +
            (strcmp(k->section, section) ? 1 + (distance(section, k->section) > 2) : 0);
        if (!near || d < least) near = k, least = d;
    }
    return ts_fail(
        st, TS_INVALID, "%s: there is no %s %.60s%s%.60s, did you mean %s.%s? (lgd-train --help-config lists all keys)",
        where, known ? "key" : "section", section, known ? "." : " with a key ", key, near->section, near->key);
}

ts_code tr_config_set(tr_config *c, const char *where, const char *section, const char *key, const char *value,
                      ts_status *st)
{
    for (int i = 0; i < tr_key_count; i++)
        if (!strcmp(tr_keys[i].section, section) && !strcmp(tr_keys[i].key, key))
            return set_value(c, where, &tr_keys[i], value, st);
    return unknown(where, section, key, st);
}

ts_code tr_config_set_assignment(tr_config *c, const char *assignment, ts_status *st)
{
    char section[64], key[64];
    const char *dot = strchr(assignment, '.'), *equals = strchr(assignment, '=');
    if (!dot || !equals || dot > equals || dot - assignment >= (ptrdiff_t)sizeof section ||
        equals - dot - 1 >= (ptrdiff_t)sizeof key)
        return ts_fail(st, TS_INVALID, "--set %.80s: expected section.key=value", assignment);
    snprintf(section, sizeof section, "%.*s", (int)(dot - assignment), assignment);
    snprintf(key, sizeof key, "%.*s", (int)(equals - dot - 1), dot + 1);
    return tr_config_set(c, "--set", section, key, equals + 1, st);
}

ts_code tr_config_read(tr_config *c, const char *path, ts_status *st)
{
    io_ini ini;
    ts_code code = io_ini_read(path, &ini, st);
    for (int i = 0; code == TS_OK && i < ini.count; i++) {
        char where[600];
        snprintf(where, sizeof where, "%.580s:%d", path, ini.entry[i].line);
        code = tr_config_set(c, where, ini.entry[i].section, ini.entry[i].key, ini.entry[i].value, st);
    }
    io_ini_free(&ini);
    return code;
}

int tr_most_given(const tr_config *c) { return c->train.given_max ? c->train.given_max : c->arch.images; }

ts_code tr_config_check(const tr_config *c, ts_status *st)
{
    const int t = c->arch.iterations;
    const int lo = c->train.iterations_min ? c->train.iterations_min : t,
              hi = c->train.iterations_max ? c->train.iterations_max : t;
    if (nn_arch_check(&c->arch, st) != TS_OK) return ts_context(st, "[model]");
    if (c->train.steps + c->train.pretrain_steps < 1)
        return ts_fail(st, TS_INVALID, "train.steps and train.pretrain_steps are both 0, there is nothing to do");
    if (c->coder.code > 0) {
        const int unit = 1 << c->coder.levels;
        if (nn_coder_check(&c->coder, st) != TS_OK) return st->code;
        if (c->arch.h_width || c->arch.iterations)
            return ts_fail(st, TS_INVALID,
                           "coder.code is %d: an auto-encoder has no refiner, so model.h_width and model.iterations "
                           "must be 0",
                           c->coder.code);
        if (c->data.patch % unit || (c->validate.every && c->validate.size % unit))
            return ts_fail(
                st, TS_INVALID,
                "data.patch is %d and validate.size %d: with %d coder.levels an auto-encoder needs multiples of %d",
                c->data.patch, c->validate.size, c->coder.levels, unit);
        if (c->train.pretrain_steps || c->train.window)
            return ts_fail(st, TS_INVALID,
                           "an auto-encoder (coder.code) has one phase and whole patches: train.pretrain_steps and "
                           "train.window must be 0");
    }
    if (c->train.steps && c->train.g_rate == 0 && !(c->arch.coarse_steps > 0 && c->train.coarse_rate > 0) &&
        !nn_arch_refines_full(&c->arch))
        return ts_fail(st, TS_INVALID,
                       "train.g_rate is 0 and there is no refiner (model.h_width): nothing would be trained");
    if (c->train.steps && c->arch.revisions > 0 && (c->train.g_rate != 0 || c->train.window))
        return ts_fail(st, TS_INVALID,
                       "model.revisions is %d: h learns over a fixed g and on whole patches, so train.g_rate and "
                       "train.window must be 0",
                       c->arch.revisions);
    if (c->train.steps && c->arch.revisions > 0 && (c->train.iterations_min || c->train.iterations_max))
        return ts_fail(st, TS_INVALID,
                       "model.revisions is %d: h is trained through all of its revisions, so train.iterations_min and "
                       "train.iterations_max must be 0",
                       c->arch.revisions);
    const int least = c->train.given_min ? c->train.given_min : tr_most_given(c);
    if (c->train.steps && c->arch.revisions > 0 && least < 2)
        return ts_fail(st, TS_INVALID,
                       "model.revisions is %d: h revises the maps of several photographs, so train.given_max must be 2 "
                       "at least, and train.given_min 0 or as many",
                       c->arch.revisions);
    if (c->train.disturb > 0 && !(c->train.steps && c->arch.revisions > 0))
        return ts_fail(
            st, TS_INVALID,
            "train.disturb is %g: it makes worse what h learns to revise, so model.revisions and train.steps "
            "must be above 0",
            c->train.disturb);
    if (c->train.steps && c->arch.descent == NN_DESCENT_POSTERIOR && c->arch.revisions == 0)
        return ts_fail(
            st, TS_INVALID,
            "train.steps is %lld, but with model.descent = posterior only h of several photographs is trained "
            "after g: set model.revisions, or train.steps to 0",
            (long long)c->train.steps);
    if (*c->train.teacher &&
        (c->train.steps || !c->arch.conditions || !c->arch.spread || !c->arch.scene || c->arch.images != 1 ||
         c->arch.channels != MAP_CHANNELS))
        return ts_fail(st, TS_INVALID,
                       "train.teacher is given: it teaches g alone, of one photograph, so train.steps must be 0, "
                       "model.images 1, model.channels %d and model.conditions, spread and scene yes",
                       MAP_CHANNELS);
    if (c->data.measured > 0 &&
        (c->train.steps || !c->arch.conditions || c->arch.images != 1 || tr_most_given(c) != 1 || c->data.sheet > 0))
        return ts_fail(st, TS_INVALID,
                       "data.measured is %g: g alone learns from such photographs, from one and told what is known, so "
                       "train.steps and data.sheet must be 0, model.images 1 and model.conditions yes",
                       c->data.measured);
    if (c->train.lesson == TR_LESSON_KNOWN && c->data.measured == 0)
        return ts_fail(st, TS_INVALID, "train.lesson is known and data.measured 0: nothing would be learned, use 0.5");
    if (c->train.lesson != TR_LESSON_DIFFUSE && !*c->train.teacher)
        return ts_fail(st, TS_INVALID,
                       "train.lesson is given without train.teacher, whose lesson it is: give both or none");
    if (c->train.steps && c->arch.conditions && c->arch.gradient && nn_arch_refines(&c->arch) &&
        c->arch.descent != NN_DESCENT_POSTERIOR && (c->data.told_view < 1 || c->data.told_power < 1))
        return ts_fail(st, TS_INVALID,
                       "data.told_view is %g and data.told_power %g: the steps of model.descent = newton, gradient and "
                       "none render with light and camera, so use 1 for both, model.descent = posterior or "
                       "train.steps = 0",
                       c->data.told_view, c->data.told_power);
    if (c->train.steps && !c->train.pretrain_steps && c->arch.revisions > 0 &&
        (c->data.told_view < 1 || c->data.told_power < 1))
        return ts_fail(
            st, TS_INVALID,
            "data.told_view is %g and data.told_power %g: h of model.revisions is told both of all photographs "
            "that it learns from, so use 1 for both",
            c->data.told_view, c->data.told_power);
    const int side = nn_arch_side(&c->arch);
    if (*c->train.teacher && c->data.patch != side)
        return ts_fail(st, TS_INVALID, "data.patch is %d: a teacher's maps have %d pixels a side", c->data.patch, side);
    if (c->train.steps && c->arch.revisions > 0 &&
        (c->data.patch != side || (c->validate.every && c->validate.size != side)))
        return ts_fail(
            st, TS_INVALID,
            "data.patch is %d and validate.size %d: revisions are of %d pixels a side, unshuffle times g_size",
            c->data.patch, c->validate.size, side);
    if ((c->data.collected > 0) != (*c->data.collection != 0))
        return ts_fail(st, TS_INVALID,
                       "data.collected is %g and data.collection \"%s\": give both, the folder and the share, or none",
                       c->data.collected, c->data.collection);
    const double narrow = c->data.fov_min, wide = c->data.fov_max;
    if ((narrow != 0 || wide != 0) && (narrow < 5 || wide < narrow))
        return ts_fail(st, TS_INVALID,
                       "data.fov_min is %g and data.fov_max %g: use 5 <= fov_min <= fov_max, or 0 for both", narrow,
                       wide);
    if (c->train.window && (c->train.window < 8 || c->train.window > c->data.patch))
        return ts_fail(st, TS_INVALID, "train.window is %d: use 8 to data.patch, which is %d, or 0", c->train.window,
                       c->data.patch);
    if (c->train.given_min > tr_most_given(c))
        return ts_fail(st, TS_INVALID,
                       "train.given_min is %d, more than the %d photographs of train.given_max or model.images",
                       c->train.given_min, tr_most_given(c));
    if (tr_most_given(c) > c->arch.images && (c->arch.revisions == 0 || c->train.pretrain_steps > 0))
        return ts_fail(st, TS_INVALID,
                       "train.given_max is %d, model.images %d: more are for h alone, so model.revisions must be above "
                       "0 and train.pretrain_steps 0",
                       c->train.given_max, c->arch.images);
    if (lo > hi)
        return ts_fail(st, TS_INVALID, "train.iterations_min is %d, more than the %d of train.iterations_max", lo, hi);
    if (c->validate.every && c->validate.seed == c->data.seed)
        return ts_fail(st, TS_INVALID,
                       "validate.seed equals data.seed: the validation materials would be those that are trained on");
    return TS_OK;
}
