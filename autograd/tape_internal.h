/* What the tape is made of: for autograd/tape.c, scope.c and checkpoint.c alone. */
#ifndef AG_TAPE_INTERNAL_H
#define AG_TAPE_INTERNAL_H
#include "autograd/packs.h"
#include "autograd/tape.h"

/* A value and where the arena stood before it was made: scopes ask which side of a mark it is on. */
typedef struct ag_held {
    ag_value v;
    size_t born;
} ag_held;

struct ag_tape {
    ts_arena *arena, *moving; /* moving: what a scope keeps and cannot be moved at once, while the arena is released */
    ag_packs *packs;
    bool gradients, frozen, passing;
    ts_compute compute;
    ag_value *into;  /* of the next operation */
    const char *way; /* of the convolution that runs, while it is traced */
    ag_node **node;  /* grown by doubling and never shrunk */
    size_t nodes, node_capacity;
    ts_status status;
    struct { /* ag_watch */
        ag_walked walked;
        void *user;
        float **grad;  /* of the parameters on the tape, in the order in which they first came */
        size_t *place; /* of each: every node that uses it has this number or a later one */
        int count, capacity;
        int left;  /* in ag_backward: that are not reported yet */
        bool part; /* the body of a part runs for its results, in backward again for the gradient */
        bool walking;
    } watch;
};

/* Fails the tape for want of memory for what; NULL. */
ag_value *ag_no_memory(ag_tape *tape, const char *what);
/* A leaf; grad (NULL: none is wanted) is where its gradient goes. */
ag_value *ag_new_value(ag_tape *tape, ts_tensor t, float *grad);
/* Forward or backward of a node, with a record for the sink of autograd/trace.h. */
void ag_run_traced(ag_tape *tape, ag_node *node, bool backward);
/* Puts the node at the end of the tape. */
bool ag_record(ag_tape *tape, ag_node *node);
/* Backward of the nodes from number first on, last first. */
void ag_walk(ag_tape *tape, size_t first);
#endif
