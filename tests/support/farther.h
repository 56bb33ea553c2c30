/* How far apart two results are at most. */
#ifndef TESTS_FARTHER_H
#define TESTS_FARTHER_H
#include <math.h>

/* The larger of the largest difference so far and another; one that is NaN is infinitely large. */
static inline double farther(double most, double difference)
{
    return isnan(difference) ? (double)INFINITY : difference > most ? difference : most;
}
#endif
