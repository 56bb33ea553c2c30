#include "tensor/threads.h"
#include "tensor/cgroup.h"
#include <omp.h>
#include <sched.h>
#include <stdatomic.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static atomic_int wanted;

bool ts_threads_pin(void)
{
    cpu_set_t all;
    const int threads = ts_threads();
    if (sched_getaffinity(0, sizeof all, &all) != 0 || CPU_COUNT(&all) < threads) return false;
    int bound = 0;
#pragma omp parallel num_threads(threads) reduction(+ : bound)
    {
        int left = omp_get_thread_num(), cpu = 0;
        while (!CPU_ISSET(cpu, &all) || left-- > 0) cpu++;
        cpu_set_t one;
        CPU_ZERO(&one);
        CPU_SET(cpu, &one);
        bound += sched_setaffinity(0, sizeof one, &one) == 0; /* of the calling thread alone */
    }
    return bound == threads;
}

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

int ts_threads_allowed(void)
{
    int n = 1;
    cpu_set_t set;
    if (sched_getaffinity(0, sizeof set, &set) == 0) n = CPU_COUNT(&set);
    ts_cgroup_each(take_quota, &n);
    return n < 1 ? 1 : n;
}

void ts_threads_set(int n) { atomic_store(&wanted, n >= 1 ? n : ts_threads_allowed()); }

int ts_threads(void)
{
    if (atomic_load_explicit(&wanted, memory_order_relaxed) == 0) ts_threads_set(0);
    return atomic_load_explicit(&wanted, memory_order_relaxed);
}
