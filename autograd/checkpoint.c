/* Parts whose inner values are computed again for the gradient. On the tape a part is one node that computes, whose
 * output is a token, followed by one for each result, which lets the first see that a gradient has come. */
#include "autograd/op.h"
#include "autograd/tape_internal.h"
#include <string.h>

typedef struct part {
    ag_body body;
    void *user;
    int ins, outs;
    ag_value *in[AG_PART_MOST], *out[AG_PART_MOST], *token;
    float *buffer[AG_PART_MOST];
    bool arrived[AG_PART_MOST]; /* a gradient at the result */
} part;

/* Where the inputs' gradients go; made before anything that the part gives back. */
typedef struct target {
    float *grad;
    bool add;
} target;

static void arrive(ag_tape *tape, ag_node *node)
{
    (void)tape;
    part *p = node->saved;
    for (int i = 0; i < p->outs; i++)
        if (p->out[i] == node->out) p->arrived[i] = true;
    p->token->grad_ready = true; /* its turn comes when all results have had theirs */
}

static void again(ag_tape *tape, ag_node *node)
{
    part *p = node->saved;
    target to[AG_PART_MOST] = {{0}};
    ag_value *in[AG_PART_MOST] = {0}, *out[AG_PART_MOST] = {0};
    for (int i = 0; i < p->ins; i++) {
        if (p->in[i] && p->in[i]->needs_grad && !p->in[i]->grad) p->in[i]->grad = p->buffer[i];
        to[i].grad = ag_grad_target(tape, p->in[i], &to[i].add);
    }
    const ts_mark mark = ts_arena_mark(tape->arena);
    const size_t first = tape->nodes;
    for (int i = 0; i < p->ins; i++) {
        in[i] = p->in[i] ? ag_new_value(tape, p->in[i]->t, to[i].grad) : NULL;
        if (in[i]) in[i]->grad_ready = to[i].add;
    }
    p->body(tape, in, out, p->user);
    for (int i = 0; i < p->outs && !tape->status.code; i++) {
        if (!p->arrived[i] || !out[i]) continue;
        out[i]->grad = p->out[i]->grad;
        out[i]->grad_ready = true;
        p->arrived[i] = false;
    }
    if (!tape->status.code) ag_walk(tape, first);
    for (int i = 0; i < p->ins && !tape->status.code; i++)
        if (to[i].grad && !in[i]->grad_ready) memset(to[i].grad, 0, (size_t)ts_count(in[i]->t.shape) * sizeof(float));
    tape->nodes = first;
    ts_arena_release(tape->arena, mark);
}

static const ag_op part_op = {.name = "part", .backward = again},
                   result_op = {.name = "result of a part", .backward = arrive};

static bool put(ag_tape *tape, part *p, const ag_op *op, ag_value *out)
{
    ag_node *node = ts_arena_zalloc(tape->arena, 1, sizeof *node);
    if (!node) return ag_fail(tape, TS_NOMEM, "no memory for a part");
    *node = (ag_node){.op = op, .out = out, .saved = p};
    out->needs_grad = true;
    return ag_record(tape, node);
}

bool ag_checkpoint(ag_tape *tape, ag_body body, const void *user, size_t size, int ins, ag_value *const *in,
                   float *const *buffer, int outs, ag_value **out)
{
    if (!ag_ready(tape, "checkpoint", 0, in)) return false;
    if (!tape->gradients) {
        body(tape, in, out, user);
        return !tape->status.code;
    }
    part *p = ts_arena_zalloc(tape->arena, 1, sizeof *p);
    ag_value *plain[AG_PART_MOST] = {0};
    if (p)
        *p = (part){.body = body,
                    .user = ts_arena_alloc(tape->arena, size),
                    .ins = ins,
                    .outs = outs,
                    .token = ag_empty(tape, (ts_shape){1, 1, 1, 1})};
    if (!p || !p->user || !p->token) return ag_fail(tape, TS_NOMEM, "no memory for a part");
    memcpy(p->user, user, size);
    for (int i = 0; i < ins; i++) {
        p->in[i] = in[i];
        p->buffer[i] = buffer[i];
        plain[i] = in[i] ? ag_detach(tape, in[i]) : NULL;
    }
    tape->gradients = false;
    tape->watch.part = true;
    const ts_mark mark = ag_scope_begin(tape);
    body(tape, plain, out, p->user);
    ag_scope_end(tape, mark, out, outs);
    tape->watch.part = false;
    tape->gradients = true;
    if (tape->status.code || !put(tape, p, &part_op, p->token)) return false;
    for (int i = 0; i < outs; i++) {
        p->out[i] = out[i];
        if (!put(tape, p, &result_op, out[i])) return false;
    }
    return true;
}
