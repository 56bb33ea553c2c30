#include "cli/arguments.h"
#include <getopt.h>
#include <string.h>

enum { OPTIONS_MAX = 64 };

int cl_argument_next(int argc, char **argv, const cl_argument *table, const char **value, int *operands, ts_status *st)
{
    struct option longs[OPTIONS_MAX + 1] = {0};
    char shorts[2 * OPTIONS_MAX + 2] = ":"; /* a leading colon tells a missing value from an unknown option */
    int n = 0;
    char *s = shorts + 1;
    for (; table[n].key && n < OPTIONS_MAX; n++) {
        longs[n] = (struct option){table[n].name, table[n].value ? required_argument : no_argument, NULL, table[n].key};
        if (table[n].key > 255) continue;
        *s++ = (char)table[n].key;
        if (table[n].value) *s++ = ':';
    }
    opterr = 0;
    const int at = optind;
    const int key = getopt_long(argc, argv, shorts, longs, NULL);
    if (key == -1) {
        *operands = optind;
        return CL_ARGUMENT_END;
    }
    if (key == '?' || key == ':') {
        /* getopt moved past the word that it did not like, unless that is one of several letters in one word */
        const char *word = argv[optind > at ? optind - 1 : optind];
        if (optopt > 0 && optopt < 256 && strncmp(word, "--", 2) != 0)
            ts_fail(st, TS_INVALID, key == ':' ? "option -%c needs a value" : "there is no option -%c", optopt);
        else
            ts_fail(st, TS_INVALID,
                    key == ':' ? "option %s needs a value"
                               : "there is no option %s, or it takes no value, or it is ambiguous",
                    word);
        return CL_ARGUMENT_BAD;
    }
    *value = optarg;
    return key;
}

const char *cl_argument_second(int argc, char **argv)
{
    return optind < argc && argv[optind][0] != '-' ? argv[optind++] : NULL;
}

void cl_argument_help(const cl_argument *table, FILE *out)
{
    for (int i = 0; table[i].key; i++) {
        char letter[8] = "", left[64];
        if (table[i].key <= 255) snprintf(letter, sizeof letter, "-%c,", table[i].key);
        snprintf(left, sizeof left, "%3s --%s%s%s", letter, table[i].name, table[i].value ? " " : "",
                 table[i].value ? table[i].value : "");
        /* two spaces at least tell the text from a value: help2man and .ci/completions.sh rely on them */
        if (strlen(left) > 22) fprintf(out, "  %s\n%26s", left, "");
        else fprintf(out, "  %-24s", left);
        for (const char *c = table[i].help; *c; c++) {
            fputc(*c, out);
            if (*c == '\n') fprintf(out, "%26s", "");
        }
        fputc('\n', out);
    }
}
