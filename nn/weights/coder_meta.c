/* What the weights file of an auto-encoder says about itself. */
#include "nn/layers.h"
#include "nn/weights/weights.h"
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { FIELDS = 4 };
static const char *const key[FIELDS] = {"coder.code", "coder.width", "coder.width_max", "coder.levels"};

static int *field(nn_coder *c, int i) { return (int *[]){&c->code, &c->width, &c->width_max, &c->levels}[i]; }

int nn_coder_to_meta(const nn_coder *c, nn_meta *meta, int capacity, char *text, size_t text_size)
{
    nn_coder copy = *c;
    size_t used = 0;
    if (capacity < FIELDS + 1) return -1;
    meta[0] = (nn_meta){"format", NN_CODER_FORMAT};
    for (int i = 0; i < FIELDS; i++) {
        const int length = snprintf(text + used, text_size - used, "%d", *field(&copy, i)) + 1;
        if (used + (size_t)length > text_size) return -1;
        meta[i + 1] = (nn_meta){key[i], text + used};
        used += (size_t)length;
    }
    return FIELDS + 1;
}

ts_code nn_coder_from_file(const nn_file *file, nn_coder *c, ts_status *st)
{
    const char *format = nn_file_meta(file, "format");
    if (!format || strcmp(format, NN_CODER_FORMAT) != 0)
        return ts_fail(st, TS_UNSUPPORTED, "%s: is no auto-encoder (configs/ablation/latent.ini trains one)",
                       nn_file_path(file));
    for (int i = 0; i < FIELDS; i++) {
        const char *text = nn_file_meta(file, key[i]);
        if (!text || strlen(text) > 9 || strspn(text, "0123456789") != strlen(text))
            return ts_fail(st, TS_FORMAT, "%s: metadata key \"%s\" is %s: a number is needed", nn_file_path(file),
                           key[i], text ? "not one" : "missing");
        *field(c, i) = atoi(text);
    }
    const ts_code code = nn_coder_check(c, st);
    if (code) ts_context(st, "%s", nn_file_path(file));
    return code;
}
