#include "tests/stress/stress.h"
#include <math.h>

bool stress_row(const char *what, double measured, double bound)
{
    const bool ok = isinf(bound) ? isfinite(measured) : measured <= bound;
    if (isinf(bound)) printf("%-64s %12.3g %12s  %s\n", what, measured, "finite", ok ? "ok" : "BROKEN");
    else printf("%-64s %12.3g %12.3g  %s\n", what, measured, bound, ok ? "ok" : "BROKEN");
    fflush(stdout);
    return ok;
}
