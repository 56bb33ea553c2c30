/* Gradients that travel as bf16 (TR_REDUCE_BF16). */
#ifndef TR_ROUNDED_H
#define TR_ROUNDED_H
#include <stddef.h>
#include <stdint.h>

/* Values that each of so many ranks sums, the last ones of them padding. */
size_t tr_rounded_part(size_t count, int ranks);
/* to [padded] = from [count] rounded to the nearest bf16, ties to even, then zeros. Infinity and NaN stay what they
 * are. */
void tr_round(const float *from, size_t count, size_t padded, uint16_t *to);
/* to [part] = the rounded sums over the ranks of from [ranks][part], made of floats in the ranks' order. */
void tr_round_sums(const uint16_t *from, int ranks, size_t part, uint16_t *to);
void tr_unround(const uint16_t *from, size_t count, float *to);
#endif
