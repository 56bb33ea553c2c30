/* The table of our names and the published ones, and how published files are recognised. */
#include "nn/weights/published.h"
#include "nn/layers.h"
#include <limits.h>
#include <stdio.h>
#include <string.h>

/* %d: the block's number, from 1. A block of either way has four linears, of which it uses two. */
static const char *const names[][2] = {
    {"g.input.conv", "preprocess_net.init_conv.conv"},
    {"g.input.global", "preprocess_net.init_conv.fullyconnect"},
    {"g.down%d.conv1", "preprocess_net.down%d.conv.conv.0"},
    {"g.down%d.conv2", "preprocess_net.down%d.conv.conv.1"},
    {"g.down%d.add", "preprocess_net.down%d.conv.fullyconnect1"},
    {"g.down%d.global", "preprocess_net.down%d.conv.fullyconnect2"},
    {"g.down%d.unused1", "preprocess_net.down%d.conv.fullyconnect3"},
    {"g.down%d.unused2", "preprocess_net.down%d.conv.fullyconnect4"},
    {"g.up%d.conv1", "preprocess_net.up%d.conv.conv.0"},
    {"g.up%d.conv2", "preprocess_net.up%d.conv.conv.1"},
    {"g.up%d.unused1", "preprocess_net.up%d.conv.fullyconnect1"},
    {"g.up%d.unused2", "preprocess_net.up%d.conv.fullyconnect2"},
    {"g.up%d.add", "preprocess_net.up%d.conv.fullyconnect3"},
    {"g.up%d.global", "preprocess_net.up%d.conv.fullyconnect4"},
    {"g.output.conv1", "preprocess_net.outc.conv.0"},
    {"g.output.conv2", "preprocess_net.outc.conv.1"},
    {"g.output.add", "preprocess_net.outc.fullyconnect"},
    {"h.gru1.ih", "main_net.rnn.layers.0.rnn_cell.ih"},
    {"h.gru1.hh", "main_net.rnn.layers.0.rnn_cell.hh"},
    {"h.conv1", "main_net.rnn.layers.0.input_fun.conv_layer"},
    {"h.gru2.ih", "main_net.rnn.layers.1.rnn_cell.ih"},
    {"h.gru2.hh", "main_net.rnn.layers.1.rnn_cell.hh"},
    {"h.conv2", "main_net.rnn.layers.1.input_fun.conv_layer"},
    {"h.output", "main_net.rnn.layers.2.input_fun.conv_layer"},
};

/* name is pattern with a number in place of its %d, if it has one. */
static bool matches(const char *name, const char *pattern, int *number)
{
    const char *hole = strstr(pattern, "%d");
    *number = 0;
    if (!hole) return !strcmp(name, pattern);
    const size_t before = (size_t)(hole - pattern);
    if (strncmp(name, pattern, before) != 0 || name[before] < '1' || name[before] > '0' + NN_MAX_LEVELS) return false;
    *number = name[before] - '0';
    return !strcmp(name + before + 1, hole + 2);
}

static void put_number(const char *pattern, int number, char *out, size_t size)
{
    const char *hole = strstr(pattern, "%d");
    if (hole) snprintf(out, size, "%.*s%d%s", (int)(hole - pattern), pattern, number, hole + 2);
    else snprintf(out, size, "%s", pattern);
}

bool nn_published_name(const char *ours, char *theirs, size_t size)
{
    for (size_t i = 0; i < sizeof names / sizeof *names; i++) {
        int number;
        if (!matches(ours, names[i][0], &number)) continue;
        put_number(names[i][1], number, theirs, size);
        return true;
    }
    return false;
}

bool nn_published_tensor(const char *name)
{
    return !strncmp(name, "preprocess_net.", 15) || !strncmp(name, "main_net.", 9);
}

static const char first_weight[] = "preprocess_net.init_conv.conv.weight";

bool nn_published_file(const nn_file *file) { return nn_file_has(file, first_weight); }

/* Dimension i of a convolution's weight; -1 where there is none. */
static int dim_of(const nn_file *file, const char *name, int i)
{
    const nn_tensor *e = nn_file_find(file, name);
    return e && e->rank == 4 && e->dim[i] <= INT_MAX ? (int)e->dim[i] : -1;
}

ts_code nn_published_arch(const nn_file *file, nn_arch *arch, ts_status *st)
{
    nn_arch a = nn_arch_default();
    a.compat = NN_COMPAT_PUBLISHED;
    a.recurrent = a.mean_before_norm = false;
    a.descent = NN_DESCENT_NONE;
    a.rmse = NN_RMSE_BATCH;
    a.encoding = NN_GRADIENT_RAW;
    a.g_size = 256;
    a.channels = dim_of(file, "preprocess_net.outc.conv.0.weight", 0);
    a.g_width = a.g_width_max = dim_of(file, first_weight, 0);
    a.g_levels = 0;
    for (int i = 1; i <= NN_MAX_LEVELS; i++) {
        char name[64];
        snprintf(name, sizeof name, "preprocess_net.down%d.conv.conv.1.weight", i);
        const int width = dim_of(file, name, 0);
        if (width < 0) break;
        a.g_levels = i;
        if (width > a.g_width_max) a.g_width_max = width;
    }
    a.g_kernel_first = dim_of(file, "preprocess_net.down1.conv.conv.0.weight", 2);
    a.g_kernel = dim_of(file, "preprocess_net.up1.conv.conv.0.weight", 2);
    a.h_width = dim_of(file, "main_net.rnn.layers.0.input_fun.conv_layer.weight", 0);
    a.h_gru = dim_of(file, "main_net.rnn.layers.0.rnn_cell.hh.weight", 1);
    if (a.h_width < 0) a.h_width = a.iterations = 0, a.h_gru = nn_arch_default().h_gru; /* g alone */
    *arch = a;
    ts_status why = {0};
    if (nn_arch_check(&a, &why))
        return ts_fail(st, TS_FORMAT, "%s: the published network's tensors in shapes that it cannot have: %s",
                       nn_file_path(file), why.message);
    return TS_OK;
}
