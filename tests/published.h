/* The published network: its architecture, and its checkpoint's names in terms of ours. */
#ifndef TESTS_PUBLISHED_H
#define TESTS_PUBLISHED_H
#include "nn/model.h"
#include <stdio.h>
#include <string.h>

static inline nn_arch published_arch(void)
{
    nn_arch a = nn_arch_default();
    a.channels = 10, a.g_width = 64, a.g_width_max = 512, a.g_levels = 7, a.g_kernel = 5, a.g_size = 256, a.h_width = 256, a.h_gru = 64;
    a.recurrent = a.mean_before_norm = a.descent = false, a.rmse = NN_RMSE_BATCH, a.encoding = NN_GRADIENT_RAW;
    return a;
}

/* The rest of a block's tensor: "conv.0.weight" -> conv1.weight, and so on. A Linear that the published network never uses: false. */
static inline bool published_part(const char *rest, bool down, char *ours, size_t size)
{
    static const char *const names[][2] = {{"conv.0.weight", "conv1.weight"}, {"conv.0.bias", "conv1.bias"},         {"conv.1.weight", "conv2.weight"},
                                           {"conv.1.bias", "conv2.bias"},     {"fullyconnect.weight", "add.weight"}, {"fullyconnect.bias", "add.bias"}};
    int number;
    char what[16];
    if (sscanf(rest, "fullyconnect%d.%15s", &number, what) == 2) {
        snprintf(ours, size, "%s.%s", number % 2 ? "add" : "global", what);
        return down == (number <= 2);
    }
    for (size_t i = 0; i < sizeof names / sizeof *names; i++)
        if (!strcmp(rest, names[i][0])) snprintf(ours, size, "%s", names[i][1]);
    return true;
}

/* theirs -> ours (size bytes, at least 64); false for a Linear that is never used. */
static inline bool published_name(const char *theirs, char *ours, size_t size)
{
    int i, n;
    char rest[64];
    *ours = 0;
    if (sscanf(theirs, "preprocess_net.init_conv.%63s", rest) == 1) {
        snprintf(ours, size, "g.input.%s%s", rest[0] == 'c' ? "conv" : "global", strrchr(rest, '.'));
    } else if (sscanf(theirs, "preprocess_net.outc.%63s", rest) == 1) {
        n = snprintf(ours, size, "g.output.");
        return published_part(rest, false, ours + n, size - (size_t)n);
    } else if (sscanf(theirs, "preprocess_net.down%d.conv.%63s", &i, rest) == 2) {
        n = snprintf(ours, size, "g.down%d.", i);
        return published_part(rest, true, ours + n, size - (size_t)n);
    } else if (sscanf(theirs, "preprocess_net.up%d.conv.%63s", &i, rest) == 2) {
        n = snprintf(ours, size, "g.up%d.", i);
        return published_part(rest, false, ours + n, size - (size_t)n);
    } else if (sscanf(theirs, "main_net.rnn.layers.%d.%63s", &i, rest) == 2) {
        const char *what = strrchr(rest, '.') + 1;
        if (!strncmp(rest, "rnn_cell.", 9)) snprintf(ours, size, "h.gru%d.%.2s.%s", i + 1, rest + 9, what);
        else if (i == 2) snprintf(ours, size, "h.output.%s", what);
        else snprintf(ours, size, "h.conv%d.%s", i + 1, what);
    }
    return true;
}
#endif
