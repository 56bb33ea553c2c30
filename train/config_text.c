/* A configuration as text: values, the whole file, the help, and the comparison of two. */
#include "data/ini.h"
#include "train/config.h"
#include <stdlib.h>
#include <string.h>

/* The shortest decimal that reads back to the same double, with a point in every locale. */
static void format_real(double v, char *text, size_t size)
{
    for (int digits = 1; digits <= 17; digits++) {
        snprintf(text, size, "%.*g", digits, v);
        if (strtod(text, NULL) == v) break;
    }
    for (char *p = text; *p; p++)
        if (*p == ',') *p = '.';
}

static void format_families(uint64_t mask, char *text, size_t size)
{
    const bool group = !mask || mask == io_family_mask("classic");
    snprintf(text, size, "%s", !group ? "" : mask ? "classic" : "all");
    for (int f = 0; !group && f < io_family_count(); f++)
        if (mask >> f & 1) {
            const size_t n = strlen(text);
            snprintf(text + n, size - n, "%s%s", n ? ", " : "", io_family_name(f));
        }
}

void tr_config_format(const tr_config *c, const tr_key *k, char *text, size_t size)
{
    const char *at = (const char *)c + k->offset;
    int n;
    switch (k->type) {
    case TR_INT: snprintf(text, size, "%d", *(const int *)(const void *)at); break;
    case TR_INT64: snprintf(text, size, "%lld", (long long)*(const int64_t *)(const void *)at); break;
    case TR_REAL: format_real(*(const double *)(const void *)at, text, size); break;
    case TR_BOOL: snprintf(text, size, "%s", *(const bool *)at ? "yes" : "no"); break;
    case TR_CHOICE:
        memcpy(&n, at, sizeof n);
        snprintf(text, size, "%s", k->choice[n]);
        break;
    case TR_TEXT: snprintf(text, size, "%s", at); break;
    case TR_FAMILIES: format_families(*(const uint64_t *)(const void *)at, text, size); break;
    }
}

enum { LONGEST = 4096 }; /* all family names in a row fit, as does a path */

void tr_config_print(const tr_config *c, bool neutral, FILE *f)
{
    const char *section = "";
    for (int i = 0; i < tr_key_count; i++) {
        char text[LONGEST];
        const tr_key *k = &tr_keys[i];
        if (k->neutral && !neutral) continue;
        if (strcmp(section, k->section)) fprintf(f, "%s[%s]\n", *section ? "\n" : "", k->section);
        section = k->section;
        tr_config_format(c, k, text, sizeof text);
        const char *mark = io_ini_needs_quotes(text) ? "\"" : "";
        fprintf(f, "%s =%s%s%s%s\n", k->key, *text ? " " : "", mark, text, mark);
    }
}

static void print_range(const tr_key *k, FILE *f)
{
    switch (k->type) {
    case TR_INT:
    case TR_INT64: fprintf(f, "integer, %.0f .. %.0f", k->lo, k->hi); break;
    case TR_REAL: fprintf(f, "number, %g .. %g", k->lo, k->hi); break;
    case TR_BOOL: fprintf(f, "yes or no"); break;
    case TR_CHOICE:
        for (int i = 0; k->choice[i]; i++) fprintf(f, "%s%s", i ? " or " : "", k->choice[i]);
        break;
    case TR_TEXT: fprintf(f, "path"); break;
    case TR_FAMILIES:
        fprintf(f, "list of all, classic");
        for (int i = 0; i < io_family_count(); i++) fprintf(f, ", %s", io_family_name(i));
        break;
    }
}

void tr_config_help(FILE *f)
{
    const tr_config c = tr_config_default();
    const char *section = "";
    for (int i = 0; i < tr_key_count; i++) {
        char text[LONGEST];
        const tr_key *k = &tr_keys[i];
        if (strcmp(section, k->section)) fprintf(f, "%s[%s]\n", *section ? "\n" : "", k->section);
        section = k->section;
        tr_config_format(&c, k, text, sizeof text);
        fprintf(f, "%s =%s%s\n    %s (", k->key, *text ? " " : "", text, k->help);
        print_range(k, f);
        fprintf(f, "%s)\n", k->neutral ? "; may change on --resume" : "");
    }
}

ts_code tr_config_same(const tr_config *then, const tr_config *now, const char *origin, ts_status *st)
{
    for (int i = 0; i < tr_key_count; i++) {
        char a[LONGEST], b[LONGEST];
        const tr_key *k = &tr_keys[i];
        if (k->neutral) continue;
        tr_config_format(then, k, a, sizeof a);
        tr_config_format(now, k, b, sizeof b);
        if (strcmp(a, b))
            return ts_fail(
                st, TS_INVALID,
                "%s.%s is %.100s, but %.200s was made with %.100s: set it back, or start another run (output.folder)",
                k->section, k->key, b, origin, a);
    }
    return TS_OK;
}
