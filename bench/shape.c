#include "bench/shape.h"
#include <stdio.h>
#include <string.h>

double bench_network_flop(const nn_model *m, const char *prefix, int side)
{
    double flop = 0;
    for (int i = 0; i < m->params; i++) {
        const nn_param *p = &m->param[i];
        if (p->rank != 4 || strncmp(p->name, prefix, strlen(prefix)) != 0) continue;
        const nn_arch *a = &m->arch;
        int at = a->g_size, level;
        if (sscanf(p->name, "g.down%d", &level) == 1) at >>= level;
        else if (sscanf(p->name, "g.up%d", &level) == 1) at >>= a->g_levels - level;
        else if (sscanf(p->name, "g.half.conv%d", &level) == 1) at *= level > 1 ? a->g_unshuffle / 2 : 1;
        else if (sscanf(p->name, "g.detail.conv%d", &level) == 1) at *= level > 3 ? a->g_unshuffle : 1;
        else if (p->name[0] == 'h') at = side;
        else if (p->name[0] == 'c') at = side < a->coarse_size ? side : a->coarse_size;
        flop += 2.0 * (double)p->count * at * at;
    }
    return flop;
}

void bench_peer_network(const char *work, const nn_arch *a, int steps, char *job, size_t size)
{
    snprintf(job, size, "%s %d %d %d %d %d %d %d %d %d %d %d %d %d %d %d", work, a->g_width, a->g_width_max,
             a->g_levels, a->g_kernel_first, a->g_kernel, a->g_size, a->h_width, a->h_gru, a->channels, a->recurrent,
             steps, steps < a->coarse_steps ? steps : a->coarse_steps, a->coarse_size, a->coarse_width, a->coarse_gru);
}

void bench_peer_guess(const char *work, const nn_arch *a, char *job, size_t size)
{
    snprintf(job, size, "%s %d %d %d %d %d %d %d %d %d %d", work, a->g_width, a->g_width_max, a->g_levels,
             a->g_kernel_first, a->g_kernel, a->g_size, a->g_unshuffle, a->g_detail, a->g_trunk, a->g_half);
}
