/* LGD_TRACE=1: a line for each operation of the tapes, on standard error. */
#include "autograd/trace.h"
#include "cli/cli.h"
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static void print(const ag_trace *r)
{
    char weight[48] = "-";
    const ts_shape w = r->weight;
    if (w.n) snprintf(weight, sizeof weight, "%dx%dx%dx%d", w.n, w.h, w.w, w.c);
    fprintf(stderr, "trace: %-14s %-8s %dx%dx%dx%d -> %dx%dx%dx%d, with %s, %s, %.3f ms\n", r->op, r->pass, r->in.n,
            r->in.h, r->in.w, r->in.c, r->out.n, r->out.h, r->out.w, r->out.c, weight, r->way ? r->way : "-",
            1e3 * r->seconds);
}

void cl_trace(void)
{
    const char *on = getenv("LGD_TRACE");
    if (on && !strcmp(on, "1")) ag_trace_set(print);
}
