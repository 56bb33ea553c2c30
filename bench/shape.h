/* The cost of networks, and their names for the peer. */
#ifndef BENCH_SHAPE_H
#define BENCH_SHAPE_H
#include "nn/model.h"

/* Multiplications and additions of the convolutions whose name starts with prefix: g at its own size (with full detail:
 * at that of squares, half of the photograph's and the photograph's), h at side x side. */
double bench_network_flop(const nn_model *m, const char *prefix, int side);

/* "WORK g_width ... T" for bench/peer_torch.py. */
void bench_peer_network(const char *work, const nn_arch *a, int steps, char *job, size_t size);

/* "WORK g_width ... g_half" of a g at full detail. */
void bench_peer_guess(const char *work, const nn_arch *a, char *job, size_t size);
#endif
