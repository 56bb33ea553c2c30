#include "autograd/trace.h"
#include "autograd/op.h"
#include "autograd/tape_internal.h"
#include <time.h>

static ag_trace_sink sink;

void ag_trace_set(ag_trace_sink to) { sink = to; }
bool ag_traced(void) { return sink != NULL; }
void ag_trace_way(ag_tape *tape, const char *way) { tape->way = way; }

static double now(void)
{
    struct timespec t;
    clock_gettime(CLOCK_MONOTONIC, &t);
    return (double)t.tv_sec + 1e-9 * (double)t.tv_nsec;
}

void ag_run_traced(ag_tape *tape, ag_node *node, bool backward)
{
    ag_trace r = {.op = node->op->name, .pass = backward ? "backward" : "forward", .out = node->out->t.shape};
    if (node->inputs > 0 && node->in[0]) r.in = node->in[0]->t.shape;
    if (node->inputs > 1 && node->in[1]) r.weight = node->in[1]->t.shape;
    const char *outer = tape->way; /* of the part that this is an operation of */
    tape->way = NULL;
    const double start = now();
    (backward ? node->op->backward : node->op->forward)(tape, node);
    r.seconds = now() - start;
    r.way = tape->way;
    tape->way = outer;
    sink(&r);
}
