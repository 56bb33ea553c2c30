#include "data/levels.h"

io_levels io_levels_of(const float *value, int64_t values)
{
    int64_t dark = 0, full = 0, over = 0;
    for (int64_t i = 0; i < values; i++) {
        dark += value[i] < 1e-3f;
        full += value[i] > 0.999f;
        over += value[i] > 1.001f;
    }
    const double all = (double)values;
    return (io_levels){(double)dark / all, (double)full / all, (double)over / all};
}
