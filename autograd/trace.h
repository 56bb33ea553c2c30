/* What each operation on a tape was, which way it went and how long it took: for programs that show it. */
#ifndef AG_TRACE_H
#define AG_TRACE_H
#include "tensor/tensor.h"

typedef struct ag_trace {
    const char *op;
    const char *pass;         /* "forward", "backward" */
    ts_shape in, weight, out; /* weight: of the second input, all 0 where there is none */
    const char *way; /* of the convolution, NULL of other operations; of backward that of the input's gradient */
    double seconds;  /* of a part (ag_checkpoint) those of its operations too, which have records of their own */
} ag_trace;

/* Calls sink after each operation of every tape, from the thread that computes; NULL: never, which is how a process
 * begins. Set before the first operation. */
typedef void (*ag_trace_sink)(const ag_trace *record);
void ag_trace_set(ag_trace_sink sink);
#endif
