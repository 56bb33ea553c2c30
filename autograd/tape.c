#include "autograd/tape.h"
#include "autograd/op.h"
#include "autograd/tape_internal.h"
#include "tensor/scratch.h"
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { LISTS = 4096 }; /* bytes of tape->moving at first: lists of what scopes keep */

/* packs: the tape's to release, also after failure; NULL after an error. */
static ag_tape *create(bool gradients, ag_packs *packs, ts_status *st)
{
    ag_tape *tape = packs ? calloc(1, sizeof *tape) : NULL;
    if (!tape) {
        if (packs) ts_fail(st, TS_NOMEM, "no memory for a tape");
        ag_packs_release(&packs);
        return NULL;
    }
    tape->gradients = gradients;
    tape->compute.exact = true;
    tape->packs = packs;
    tape->arena = ts_arena_create(0, st);
    tape->moving = tape->arena ? ts_arena_create(LISTS, st) : NULL;
    if (!tape->moving) ag_tape_destroy(&tape);
    return tape;
}

ag_tape *ag_tape_create(bool gradients, ts_status *st) { return create(gradients, ag_packs_create(st), st); }

ag_tape *ag_tape_sharing(const ag_tape *other, ts_status *st)
{
    if (!other->frozen) {
        ts_fail(st, TS_INVALID, "a tape that shares the packed weights of one that is not frozen");
        return NULL;
    }
    ag_tape *tape = create(false, ag_packs_hold(other->packs), st);
    if (tape) tape->frozen = true;
    return tape;
}

void ag_tape_destroy(ag_tape **tape)
{
    if (!*tape) return;
    ts_arena_destroy(&(*tape)->arena);
    ag_packs_release(&(*tape)->packs);
    ts_arena_destroy(&(*tape)->moving);
    free((*tape)->node);
    free((*tape)->watch.grad);
    free((*tape)->watch.place);
    free(*tape);
    *tape = NULL;
}

void ag_reset(ag_tape *tape)
{
    ts_arena_reset(tape->arena);
    ts_scratch_level(tape->compute.threads);
    tape->nodes = 0;
    tape->watch.count = 0;
    tape->into = NULL;
    tape->status = (ts_status){0};
    if (!tape->frozen) ag_packs_forget(tape->packs);
}

void ag_drop(ag_tape *tape)
{
    ag_reset(tape);
    ts_arena_drop(tape->arena);
    ts_arena_drop(tape->moving);
}

const ts_status *ag_status(const ag_tape *tape) { return &tape->status; }
ts_arena *ag_arena(ag_tape *tape) { return tape->arena; }
bool ag_gradients(const ag_tape *tape) { return tape->gradients; }
void ag_compute_set(ag_tape *tape, ts_compute compute) { tape->compute = compute; }
const ts_compute *ag_compute(const ag_tape *tape) { return &tape->compute; }
void ag_freeze(ag_tape *tape, bool frozen) { tape->frozen = frozen; }

ag_value *ag_fail(ag_tape *tape, ts_code code, const char *format, ...)
{
    if (tape->status.code == TS_OK) {
        va_list args;
        va_start(args, format);
        vsnprintf(tape->status.message, sizeof tape->status.message, format, args);
        va_end(args);
        tape->status.code = code;
    }
    return NULL;
}

ag_value *ag_no_memory(ag_tape *tape, const char *what)
{
    return ag_fail(tape, TS_NOMEM, "no memory for %s (the tape already holds %zu MiB); use smaller images or batches",
                   what, ts_arena_used(tape->arena) >> 20);
}

bool ag_ready(ag_tape *tape, const char *op, int count, ag_value *const *in)
{
    if (tape->status.code != TS_OK) return false;
    for (int i = 0; i < count; i++)
        if (!in[i]) {
            ag_fail(tape, TS_INVALID, "%s: input %d is missing", op, i);
            return false;
        }
    return true;
}

const char *ag_shape_text(char text[AG_SHAPE_TEXT], ts_shape s)
{
    snprintf(text, AG_SHAPE_TEXT, "[%d,%d,%d,%d]", s.n, s.h, s.w, s.c);
    return text;
}

ag_value *ag_new_value(ag_tape *tape, ts_tensor t, float *grad)
{
    if (tape->status.code != TS_OK) return NULL;
    size_t born = ts_arena_used(tape->arena);
    ag_held *held = ts_arena_alloc(tape->arena, sizeof *held);
    if (!held) return ag_no_memory(tape, "a value");
    *held = (ag_held){{t, grad, grad != NULL, grad != NULL}, born};
    return &held->v;
}

static ag_value *new_leaf(ag_tape *tape, ts_tensor t, float *grad)
{
    if (tape->status.code != TS_OK) return NULL;
    if (!t.data || t.shape.n < 1 || t.shape.h < 1 || t.shape.w < 1 || t.shape.c < 1)
        return ag_fail(tape, TS_INVALID, "leaf: no data or an empty shape [%d,%d,%d,%d]", t.shape.n, t.shape.h,
                       t.shape.w, t.shape.c);
    if (!ts_contiguous(&t))
        return ag_fail(tape, TS_INVALID, "leaf: the tensor is a strided view; copy it with ts_copy first");
    return ag_new_value(tape, t, grad);
}

ag_value *ag_constant(ag_tape *tape, ts_tensor t) { return new_leaf(tape, t, NULL); }

void ag_watch(ag_tape *tape, ag_walked walked, void *user)
{
    tape->watch.walked = walked;
    tape->watch.user = user;
}

/* Operations that use a parameter are put on the tape after it: its gradient is complete when all from there on have
 * been gone through. Of several leaves with one gradient the first counts. */
static void note_place(ag_tape *tape, float *grad)
{
    for (int i = 0; i < tape->watch.count; i++)
        if (tape->watch.grad[i] == grad) return;
    if (tape->watch.count == tape->watch.capacity) {
        const int more = tape->watch.capacity ? 2 * tape->watch.capacity : 64;
        float **g = realloc(tape->watch.grad, (size_t)more * sizeof *g);
        if (g) tape->watch.grad = g;
        size_t *p = realloc(tape->watch.place, (size_t)more * sizeof *p);
        if (p) tape->watch.place = p;
        if (!g || !p) {
            ag_no_memory(tape, "the list of parameters");
            return;
        }
        tape->watch.capacity = more;
    }
    tape->watch.place[tape->watch.count] = tape->nodes;
    tape->watch.grad[tape->watch.count++] = grad;
}

ag_value *ag_parameter(ag_tape *tape, ts_tensor t, float *grad)
{
    if (grad && tape->watch.walked && (tape->gradients || tape->watch.part) && !tape->watch.walking)
        note_place(tape, grad);
    return new_leaf(tape, t, tape->gradients ? grad : NULL);
}

ag_value *ag_empty(ag_tape *tape, ts_shape shape)
{
    ag_value *v = ag_new_value(tape, (ts_tensor){0}, NULL); /* the header first: one order for values and their data */
    if (!v) return NULL;
    v->t = ts_new(tape->arena, shape);
    if (!v->t.data) return ag_no_memory(tape, "a value's data");
    return v;
}

ag_value *ag_detach(ag_tape *tape, ag_value *v)
{
    if (!ag_ready(tape, "detach", 1, &v)) return NULL;
    return ag_new_value(tape, v->t, NULL);
}

bool ag_record(ag_tape *tape, ag_node *node)
{
    if (tape->nodes == tape->node_capacity) {
        const size_t more = tape->node_capacity ? 2 * tape->node_capacity : 256;
        ag_node **grown = realloc(tape->node, more * sizeof *grown);
        if (!grown) return ag_no_memory(tape, "the list of operations");
        tape->node = grown;
        tape->node_capacity = more;
    }
    tape->node[tape->nodes++] = node;
    return true;
}

void ag_into(ag_tape *tape, ag_value *to)
{
    if (to && tape->gradients) ag_fail(tape, TS_INVALID, "into: a tape with gradients keeps every value");
    tape->into = to;
}

/* Where the operation's result goes. */
static ag_value *result(ag_tape *tape, const ag_op *op, ts_shape out)
{
    ag_value *v = tape->into;
    tape->into = NULL;
    if (!v) return ag_empty(tape, out);
    char a[AG_SHAPE_TEXT], b[AG_SHAPE_TEXT];
    return ts_same(v->t.shape, out) ? v
                                    : ag_fail(tape, TS_INVALID, "%s: the result is %s, the place for it %s", op->name,
                                              ag_shape_text(a, out), ag_shape_text(b, v->t.shape));
}

ag_value *ag_apply(ag_tape *tape, const ag_op *op, int inputs, ag_value *const *in, ts_shape out, const void *attr,
                   size_t attr_size)
{
    if (tape->status.code != TS_OK) return NULL;
    ag_value *v = result(tape, op, out);
    ag_node *node = ts_arena_zalloc(tape->arena, 1, sizeof *node);
    void *copy = attr_size ? ts_arena_alloc(tape->arena, attr_size) : NULL;
    if (!v || !node || (attr_size && !copy)) return ag_no_memory(tape, op->name);
    if (attr_size) memcpy(copy, attr, attr_size);
    *node = (ag_node){.op = op, .inputs = inputs, .out = v, .attr = copy};
    for (int i = 0; i < inputs; i++) {
        node->in[i] = in[i];
        if (in[i] && in[i]->needs_grad) v->needs_grad = true;
    }
    if (ag_traced()) ag_run_traced(tape, node, false);
    else op->forward(tape, node);
    if (tape->status.code != TS_OK) return NULL;
    return v->needs_grad && !ag_record(tape, node) ? NULL : v;
}

float *ag_grad_target(ag_tape *tape, ag_value *v, bool *accumulate)
{
    if (!v || !v->needs_grad) return NULL;
    if (!v->grad) {
        v->grad = ts_arena_alloc(tape->arena, (size_t)ts_count(v->t.shape) * sizeof(float));
        if (!v->grad) {
            ag_no_memory(tape, "a gradient");
            return NULL;
        }
    }
    *accumulate = v->grad_ready;
    v->grad_ready = true;
    return v->grad;
}

bool ag_grad_move(ag_value *from, ag_value *v)
{
    if (!v || !v->needs_grad || v->grad) return false;
    v->grad = from->grad;
    v->grad_ready = true;
    from->grad = NULL;
    return true;
}

float *ag_grad_add(ag_tape *tape, ag_value *v)
{
    bool accumulate;
    float *g = ag_grad_target(tape, v, &accumulate);
    if (g && !accumulate) memset(g, 0, (size_t)ts_count(v->t.shape) * sizeof(float));
    return g;
}

/* Of the parameters that only nodes from number node on use; a part's own nodes come after all that are on the tape. */
static void report_gradient(ag_tape *tape, size_t node)
{
    int count = 0;
    while (count < tape->watch.left && tape->watch.place[tape->watch.left - count - 1] >= node) count++;
    tape->watch.left -= count;
    tape->watch.walked(tape->watch.grad + tape->watch.left, count, tape->watch.user);
}

void ag_walk(ag_tape *tape, size_t first)
{
    for (size_t i = tape->nodes; i-- > first;) {
        ag_node *node = tape->node[i];
        if (node->out->grad_ready) { /* else the loss does not depend on it */
            if (ag_traced()) ag_run_traced(tape, node, true);
            else node->op->backward(tape, node);
            if (tape->status.code != TS_OK) break;
            node->out->grad_ready = false; /* passed on; a second backward starts it anew */
        }
        if (tape->watch.walked) report_gradient(tape, i);
    }
}

ts_code ag_backward(ag_tape *tape, ag_value *loss)
{
    if (!ag_ready(tape, "backward", 1, &loss)) return tape->status.code;
    if (!tape->gradients) ag_fail(tape, TS_INVALID, "backward: the tape was created without gradients");
    else if (ts_count(loss->t.shape) != 1)
        ag_fail(tape, TS_INVALID, "backward: the loss has %lld values, not one", (long long)ts_count(loss->t.shape));
    else if (!loss->needs_grad) ag_fail(tape, TS_INVALID, "backward: the loss does not depend on any parameter");
    float *seed = tape->status.code == TS_OK ? ag_grad_add(tape, loss) : NULL;
    if (!seed) return tape->status.code;
    seed[0] += 1.0f;
    tape->watch.left = tape->watch.count;
    tape->watch.walking = true;
    ag_walk(tape, 0);
    tape->watch.walking = false;
    return tape->status.code;
}

const float *ag_packed(ag_tape *tape, const ts_conv *c, ts_conv_use use, const float *weight)
{
    const float *packed = tape->passing ? ag_packs_pass(tape->packs, c, use, weight, tape->arena)
                                        : ag_packs_find(tape->packs, c, use, weight);
    if (!packed) ag_no_memory(tape, "packed weights");
    return packed;
}

void ag_pass(ag_tape *tape, bool passing) { tape->passing = passing && !tape->gradients; }

void ag_halves_from(ag_tape *tape, ag_halves halves, void *user) { ag_packs_halves(tape->packs, halves, user); }

const void *ag_half(ag_tape *tape, const float *weight) { return ag_packs_half(tape->packs, weight); }

const ag_node *ag_node_of(const ag_tape *tape, const ag_value *v)
{
    for (size_t i = tape->nodes; i-- > 0;)
        if (tape->node[i]->out == v) return tape->node[i];
    return NULL;
}
