#include "infer/memory.h"
#include <math.h>
#include <stdio.h>

/* The number in a file, or -1 for a word such as "max" and for no file. */
static double number_in(const char *path)
{
    double v = -1;
    FILE *f = fopen(path, "re");
    if (!f) return -1;
    if (fscanf(f, "%lf", &v) != 1) v = -1;
    fclose(f);
    return v;
}

/* What new allocations can have without pushing others out, and the free swap. */
static double system_free(void)
{
    char line[256];
    double sum = 0, kib;
    FILE *f = fopen("/proc/meminfo", "re");
    if (!f) return INFINITY;
    int found = 0;
    while (fgets(line, sizeof line, f)) {
        if (sscanf(line, "MemAvailable: %lf", &kib) != 1 && sscanf(line, "SwapFree: %lf", &kib) != 1) continue;
        sum += kib * 1024;
        found++;
    }
    fclose(f);
    return found ? sum : INFINITY;
}

ts_code lgd_memory_check(double bytes, ts_status *st)
{
    double left = system_free();
    const double limit = number_in("/sys/fs/cgroup/memory.max"),
                 used = number_in("/sys/fs/cgroup/memory.current"); /* a container's own */
    if (limit > 0 && used >= 0) left = fmin(left, fmax(limit - used, 0));
    if (bytes <= left) return TS_OK;
    return ts_fail(st, TS_NOMEM, "about %.1f GB of memory are needed and %.1f GB are free: use a smaller size",
                   bytes * 1e-9, left * 1e-9);
}
