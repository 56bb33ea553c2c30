#include "tensor/peak.h"
#include "tensor/kernels/peak.h"
#include "tensor/threads.h"
#include <omp.h>

double ts_fma_peak(void)
{
    double best = 0;
    for (int i = 0; i < 4; i++) {
        double flop = 0;
        const double begin = omp_get_wtime();
#pragma omp parallel num_threads(ts_threads()) reduction(+ : flop)
        flop += ts_peak_k()->run(2000000);
        const double speed = flop / (omp_get_wtime() - begin);
        if (speed > best) best = speed;
    }
    return best;
}
