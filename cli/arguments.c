#include "cli/arguments.h"
#include <string.h>

enum { OPTIONS_MAX = 64 };

/* What is wrong with the word of which getopt_long said '?' or ':'. */
static void say_fault(int fault, const char *word, const struct option *longs, ts_status *st)
{
    const int length = (int)strcspn(word, "=");
    if (optopt > 0 && optopt < 256 && strncmp(word, "--", 2) != 0) {
        ts_fail(st, TS_INVALID, fault == ':' ? "option -%c needs a value" : "there is no option -%c", optopt);
        return;
    }
    const struct option *found[2] = {NULL, NULL}; /* of which it is the beginning */
    for (const struct option *o = longs; o->name && length > 2; o++) {
        if (strncmp(o->name, word + 2, (size_t)length - 2) != 0) continue;
        found[found[0] != NULL] = o;
        if ((int)strlen(o->name) > length - 2) continue;
        found[0] = o;
        found[1] = NULL;
        break;
    }
    if (fault == ':') ts_fail(st, TS_INVALID, "option %s needs a value", word);
    else if (!found[0]) ts_fail(st, TS_INVALID, "there is no option %.*s", length, word);
    else if (found[1])
        ts_fail(st, TS_INVALID, "%.*s may be --%s or --%s: write it out", length, word, found[0]->name, found[1]->name);
    else ts_fail(st, TS_INVALID, "option --%s takes no value", found[0]->name);
}

int cl_option_next(int argc, char **argv, const char *shorts, const struct option *longs, ts_status *st)
{
    opterr = 0;
    const int at = optind, key = getopt_long(argc, argv, shorts, longs, NULL);
    if (key != '?' && key != ':') return key;
    /* getopt moved past the word that it did not like, unless that is one of several letters in one word */
    say_fault(key, argv[optind > at ? optind - 1 : optind], longs, st);
    return CL_ARGUMENT_BAD;
}

int cl_argument_next(int argc, char **argv, const cl_argument *table, const char **value, int *operands, ts_status *st)
{
    struct option longs[OPTIONS_MAX + 1] = {0};
    char shorts[2 * OPTIONS_MAX + 2] = ":";
    int n = 0;
    char *s = shorts + 1;
    for (; table[n].key && n < OPTIONS_MAX; n++) {
        longs[n] = (struct option){table[n].name, table[n].value ? required_argument : no_argument, NULL, table[n].key};
        if (table[n].key > 255) continue;
        *s++ = (char)table[n].key;
        if (table[n].value) *s++ = ':';
    }
    const int key = cl_option_next(argc, argv, shorts, longs, st);
    if (key == CL_ARGUMENT_END) *operands = optind;
    *value = optarg;
    return key;
}

const char *cl_argument_second(int argc, char **argv)
{
    return optind < argc && argv[optind][0] != '-' ? argv[optind++] : NULL;
}

ts_code cl_check_name(const char *what, const char *name, ts_status *st)
{
    return *name ? TS_OK : ts_fail(st, TS_INVALID, "%s: the name is empty", what);
}

void cl_argument_help(const cl_argument *table, FILE *out)
{
    for (int i = 0; table[i].key; i++) {
        char letter[8] = "", left[64];
        if (table[i].key <= 255) snprintf(letter, sizeof letter, "-%c,", table[i].key);
        snprintf(left, sizeof left, "%3s --%s%s%s", letter, table[i].name, table[i].value ? " " : "",
                 table[i].value ? table[i].value : "");
        /* two spaces at least separate the text from a value: help2man and .ci/completions.sh rely on them */
        if (strlen(left) > 22) fprintf(out, "  %s\n%26s", left, "");
        else fprintf(out, "  %-24s", left);
        for (const char *c = table[i].help; *c; c++) {
            fputc(*c, out);
            if (*c == '\n') fprintf(out, "%26s", "");
        }
        fputc('\n', out);
    }
}
