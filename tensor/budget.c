#include "tensor/budget.h"
#include "tensor/cgroup.h"
#include <math.h>
#include <pthread.h>
#include <stdatomic.h>
#include <stdbool.h>
#include <stdio.h>
#include <string.h>

static _Atomic double limit; /* 0: the default */

/* The number in a file, or -1 for a word such as "max" and for no file. */
static double number_in(const char *folder, const char *name)
{
    char path[700];
    double v = -1;
    snprintf(path, sizeof path, "%s/%s", folder, name);
    FILE *f = fopen(path, "re");
    if (!f) return -1;
    if (fscanf(f, "%lf", &v) != 1) v = -1;
    fclose(f);
    return v;
}

/* The sum of the values, in units of unit, of those names in a file of lines "NAME VALUE"; -1: it does not have the
 * first of them. */
static double sum_in(const char *path, const char *const *names, double unit)
{
    char line[256], name[64];
    double sum = 0, value;
    int found = 0;
    bool first = false;
    FILE *f = fopen(path, "re");
    if (!f) return -1;
    int wanted = 0;
    while (names[wanted]) wanted++;
    while (found < wanted && fgets(line, sizeof line, f))
        for (int i = 0; i < wanted; i++)
            if (sscanf(line, "%63s %lf", name, &value) == 2 && strcmp(name, names[i]) == 0)
                sum += value * unit, found++, first |= i == 0;
    fclose(f);
    return first ? sum : -1;
}

typedef struct memory {
    double all, left; /* bytes */
} memory;

static void bound(memory *m, double most, double used, double files)
{
    if (!(most > 0)) return;
    m->all = fmin(m->all, most);
    if (used >= 0) m->left = fmin(m->left, fmax(most - used + fmax(files, 0), 0));
}

static void visit(const char *folder, void *user)
{
    static const char *const files[] = {"inactive_file", "active_file", NULL}; /* given up when others ask */
    char path[700];
    snprintf(path, sizeof path, "%s/memory.stat", folder);
    bound(user, number_in(folder, "memory.max"), number_in(folder, "memory.current"), sum_in(path, files, 1));
    snprintf(path, sizeof path, "%s/memory/memory.stat", folder); /* version 1 */
    bound(user, number_in(folder, "memory/memory.limit_in_bytes"), number_in(folder, "memory/memory.usage_in_bytes"),
          sum_in(path, files, 1));
}

static memory find(void)
{
    static const char *const all[] = {"MemTotal:", NULL}, *const left[] = {"MemAvailable:", "SwapFree:", NULL};
    const double total = sum_in("/proc/meminfo", all, 1024), available = sum_in("/proc/meminfo", left, 1024);
    memory m = {total > 0 ? total : INFINITY, available >= 0 ? available : INFINITY};
    ts_cgroup_each(visit, &m);
    return m;
}

static double whole; /* memory of the machine or the control groups: does not change while a program runs */
static pthread_once_t once = PTHREAD_ONCE_INIT;
static void find_whole(void) { whole = find().all; }

static double most(void)
{
    const double set = atomic_load(&limit);
    pthread_once(&once, find_whole);
    return set > 0 ? set : 0.75 * whole;
}

void ts_budget_set(double bytes) { atomic_store(&limit, bytes); }

double ts_budget_left(void) { return fmin(most(), find().left); }

ts_code ts_budget_check(double bytes, ts_status *st)
{
    if (bytes > most())
        return ts_fail(st, TS_NOMEM,
                       "about %.3g GB of memory are needed and the limit is %.3g GB (lgd-infer "
                       "--max-memory)",
                       bytes * 1e-9, most() * 1e-9);
    const double left = find().left;
    if (bytes <= left) return TS_OK;
    return ts_fail(st, TS_NOMEM, "about %.3g GB of memory are needed and %.3g GB are free: use a smaller size",
                   bytes * 1e-9, left * 1e-9);
}
