#include "tensor/threads.h"
#include "tensor/cgroup.h"
#include <limits.h>
#include <sched.h>
#include <stdatomic.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static atomic_int wanted;

/* CPUs' worth of quota in a cgroup v2 or v1 hierarchy as a container sees it, or 0 for none. */
static int quota_in(const char *max_path, const char *quota_path, const char *period_path)
{
    long long quota = -1, period = -1;
    FILE *f = fopen(max_path, "re");
    if (f) {
        if (fscanf(f, "%lld %lld", &quota, &period) != 2) quota = -1; /* the word "max": no limit */
        fclose(f);
    } else {
        FILE *q = fopen(quota_path, "re"), *p = fopen(period_path, "re");
        if (!q || !p || fscanf(q, "%lld", &quota) != 1 || fscanf(p, "%lld", &period) != 1) quota = -1;
        if (q) fclose(q);
        if (p) fclose(p);
    }
    if (quota <= 0 || period <= 0) return 0;
    return (int)((quota + period - 1) / period);
}

static void take_quota(const char *folder, void *user)
{
    char path[700];
    int *least = user;
    snprintf(path, sizeof path, "%s/cpu.max", folder);
    const int quota = quota_in(path, "/sys/fs/cgroup/cpu/cpu.cfs_quota_us", "/sys/fs/cgroup/cpu/cpu.cfs_period_us");
    if (quota && quota < *least) *least = quota;
}

enum { MOST_THREADS = 1024 };

/* The first number of a variable of OpenMP's ("4", "4,2"): 0 where it is not set, -1 where it is no number of threads.
 */
static int from_environment(const char *name)
{
    const char *text = getenv(name);
    char *end;
    if (!text || !*text) return 0;
    const long n = strtol(text, &end, 10);
    while (*end == ' ') end++;
    return n < 1 || end == text || (*end && *end != ',') ? -1 : n < MOST_THREADS ? (int)n : MOST_THREADS;
}

ts_code ts_threads_check(ts_status *st)
{
    static const char *const names[] = {"OMP_NUM_THREADS", "OMP_THREAD_LIMIT"};
    for (int i = 0; i < 2; i++)
        if (from_environment(names[i]) < 0)
            return ts_fail(st, TS_INVALID,
                           "%s is \"%s\", which is no number of threads: set it to 1 or more, or unset it", names[i],
                           getenv(names[i]));
    return TS_OK;
}

int ts_threads_of_share(int cpus, int processes)
{
    const int asked = from_environment("OMP_NUM_THREADS"), limit = from_environment("OMP_THREAD_LIMIT");
    int quota = INT_MAX, n = cpus;
    ts_cgroup_each(take_quota, &quota);
    if (quota / processes < n) n = quota / processes;
    if (asked > 0) n = asked;
    if (limit > 0 && limit < n) n = limit;
    return n < 1 ? 1 : n;
}

/* CPUs of the affinity mask; the kernel refuses a set without room for all CPUs that it knows. */
static int cpus_of_process(void)
{
    enum { MOST_CPUS = 1 << 20 };
    int cpus = 0;
    for (int n = CPU_SETSIZE; !cpus && n <= MOST_CPUS; n *= 2) {
        cpu_set_t *set = CPU_ALLOC(n);
        const size_t size = CPU_ALLOC_SIZE(n);
        if (!set) return 1;
        if (sched_getaffinity(0, size, set) == 0) cpus = CPU_COUNT_S(size, set);
        CPU_FREE(set);
    }
    return cpus > 0 ? cpus : 1;
}

int ts_threads_allowed(void)
{
    const int cpus = cpus_of_process();
    return ts_threads_of_share(cpus < MOST_THREADS ? cpus : MOST_THREADS, 1);
}

void ts_threads_set(int n) { atomic_store(&wanted, n >= 1 ? n : ts_threads_allowed()); }

int ts_threads(void)
{
    if (atomic_load_explicit(&wanted, memory_order_relaxed) == 0) ts_threads_set(0);
    return atomic_load_explicit(&wanted, memory_order_relaxed);
}
