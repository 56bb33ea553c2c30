/* How many numbers of a network are trained. */
#ifndef TESTS_TRAINED_H
#define TESTS_TRAINED_H
#include "nn/layers.h"

/* Trained numbers in a part, without the block's padding. */
static inline size_t trained_numbers(const nn_model *m, nn_part part)
{
    const int *first = ((const nn_layers *)m->layers)->first;
    size_t sum = 0;
    for (int i = first[part]; i < first[part + 1]; i++) sum += m->param[i].count;
    return sum;
}
#endif
