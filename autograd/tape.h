/* The tape: values, and the operations that made them, in order. Forward runs at once, when an op is put on the tape;
 * ag_backward walks the list from the end.
 *
 * Memory: values, saved data and gradients live in the tape's arena until ag_reset. A tape that was created without
 * gradients records nothing, and ag_scope_... gives intermediate memory back early.
 * Errors are sticky: the first is kept in the tape, every constructor then returns NULL and accepts NULL inputs, so
 * that model code needs one check at its end (ag_status). */
#ifndef AG_TAPE_H
#define AG_TAPE_H
#include "tensor/arena.h"
#include "tensor/conv/conv.h"
#include "tensor/rng.h"
#include "tensor/tensor.h"

typedef struct ag_tape ag_tape;
typedef struct ag_value ag_value;
typedef struct ag_node ag_node;
typedef struct ag_gradcheck ag_gradcheck;

enum { AG_MAX_INPUTS = 8 };

struct ag_value {
    ts_tensor t;     /* contiguous */
    float *grad;     /* the same shape, or NULL while no gradient has reached it; only a parameter's is of use after
                        ag_backward */
    bool needs_grad; /* a parameter, or made from one */
    bool grad_ready; /* grad holds values to be added to (false: the next writer overwrites) */
};

/* What an operation is. One constant of this type per file autograd/op_NAME.c or render/op_NAME.c, called op_NAME; make
 * collects them. */
typedef struct ag_op {
    const char *name;
    /* out->t.data from in[...]->t.data; shapes were validated. */
    void (*forward)(ag_tape *tape, ag_node *node);
    /* Adds to the gradients of the inputs that need one (ag_grad_target), from node->out->grad. */
    void (*backward)(ag_tape *tape, ag_node *node);
    /* The same function as forward in double and as plain as possible: the oracle of the tests. in[i] has the input's
     * count. */
    void (*reference)(const ag_node *node, const double *const *in, double *out);
    /* Puts random cases, edges included, through ag_gradcheck_run. */
    void (*cases)(ag_gradcheck *check);
} ag_op;

struct ag_node {
    const ag_op *op;
    int inputs;
    ag_value *in[AG_MAX_INPUTS]; /* an optional input that was not given is NULL */
    ag_value *out;
    void *attr;  /* the op's own constants, copied into the arena */
    void *saved; /* what forward keeps for backward, in the arena */
};

/* gradients: whether ag_backward will be called. The arena is the tape's own. NULL and st set on failure. */
ag_tape *ag_tape_create(bool gradients, ts_status *st);
/* One without gradients, frozen, with the packed weights of other, which is frozen too and stays so while both exist:
 * the two may be used by two threads at once, and destroyed in any order. NULL and st set on failure. */
ag_tape *ag_tape_sharing(const ag_tape *other, ts_status *st);
void ag_tape_destroy(ag_tape **tape);

/* Forgets all values and the error, keeps the memory. Packed weights are forgotten too unless ag_freeze was called. */
void ag_reset(ag_tape *tape);

/* ag_reset, and the memory goes back to the system, but for packed weights. */
void ag_drop(ag_tape *tape);

const ts_status *ag_status(const ag_tape *tape); /* the first error, or code TS_OK */
ts_arena *ag_arena(ag_tape *tape);
bool ag_gradients(const ag_tape *tape);
/* How the operations from now on are computed, and their gradients. A new tape's: exact, TS_F32, the process's threads.
 */
void ag_compute_set(ag_tape *tape, ts_compute compute);
const ts_compute *ag_compute(const ag_tape *tape);
/* Sets the sticky error (the first one stays). Returns NULL for convenience. */
ag_value *ag_fail(ag_tape *tape, ts_code code, const char *format, ...) __attribute__((format(printf, 3, 4)));

/* A leaf without gradient: the data is the caller's and outlives the tape's use of it. */
ag_value *ag_constant(ag_tape *tape, ts_tensor t);
/* A leaf with gradient: grad has t's shape, belongs to the caller, and is added to by ag_backward. grad NULL: as
 * ag_constant. */
ag_value *ag_parameter(ag_tape *tape, ts_tensor t, float *grad);
/* Uninitialised constant of that shape in the arena. */
ag_value *ag_empty(ag_tape *tape, ts_shape shape);
/* The next operation on a tape without gradients writes its result into the memory of to (NULL: of a new value) and
 * returns to, whose shape must fit. Operations that go value by value or pixel by pixel (ag_add, ag_tanh, ag_gru's
 * state) may overwrite an input so. */
void ag_into(ag_tape *tape, ag_value *to);
/* The same data without its history: no gradient flows through. */
ag_value *ag_detach(ag_tape *tape, ag_value *v);

/* For op constructors: makes the output, runs forward, records the node when a gradient will be asked for.
 * attr (attr_size bytes) is copied. The caller has validated shapes. NULL after an error. */
ag_value *ag_apply(ag_tape *tape, const ag_op *op, int inputs, ag_value *const *in, ts_shape out, const void *attr,
                   size_t attr_size);

/* For backward: where to put the gradient of v, or NULL when nobody needs it. *accumulate says whether to add to what
 * is there (true) or to overwrite every value (false); afterwards the gradient counts as written. */
float *ag_grad_target(ag_tape *tape, ag_value *v, bool *accumulate);
/* Makes the gradient of `from`, which has been made and which nobody reads afterwards, that of v, of as many values,
 * without a copy. False, with nothing done, when v has one already or needs none. */
bool ag_grad_move(ag_value *from, ag_value *v);
/* As ag_grad_target, always to be added to (zeros were put there when it was fresh). */
float *ag_grad_add(ag_tape *tape, ag_value *v);

/* d loss / d parameter is added to every parameter's grad. loss: one value. Returns the tape's code. May be called
 * again, for another loss or the same one: the gradients of all calls add up. */
ts_code ag_backward(ag_tape *tape, ag_value *loss);

/* Called by ag_backward after each operation that it has gone through: grad[0 .. count - 1], as ag_parameter was given
 * them, are complete, nothing that is left of the tape adds to them. Every gradient of ag_parameter is reported once in
 * an ag_backward; count may be 0. For what is put on the tape from then on; NULL: none is reported. */
typedef void (*ag_walked)(float *const *grad, int count, void *user);
void ag_watch(ag_tape *tape, ag_walked walked, void *user);

/* A part of a network of which a tape with gradients keeps the results alone: body puts its operations on the tape, is
 * called once for the results, without recording, and once more in ag_backward for the gradient (Chen et al., "Training
 * Deep Nets with Sublinear Memory Cost", 2016). The same numbers as without. in[i] may be NULL and reaches body so,
 * with gradients otherwise as it has them; body sets out[0 .. outs - 1] to values that its own operations made, and
 * must do the same each time. user (size bytes) is copied. buffer[i]: NULL, or memory for the gradient of in[i], which
 * is of use from the end of the backward of what follows this part to the end of its own: neighbours in a chain of
 * parts take turns with two. On a tape without gradients body is simply called. False after an error. */
enum { AG_PART_MOST = 4 }; /* ins and outs */
typedef void (*ag_body)(ag_tape *tape, ag_value *const *in, ag_value **out, const void *user);
bool ag_checkpoint(ag_tape *tape, ag_body body, const void *user, size_t size, int ins, ag_value *const *in,
                   float *const *buffer, int outs, ag_value **out);

/* Packed weights of a convolution, made once per reset (or once for all after ag_freeze(tape, true)). Keyed by weight
 * address, use and shape. */
const float *ag_packed(ag_tape *tape, const ts_conv *c, ts_conv_use use, const float *weight);
void ag_freeze(ag_tape *tape, bool frozen);
/* On a tape without gradients: weights that are asked for while passing are for one use. They are packed where the
 * operation has its intermediate values, which the next one has again: that memory is neither cleared by the system for
 * each layer nor far from the caches. */
void ag_pass(ag_tape *tape, bool passing);
/* Weights of convolutions and linear layers that are in memory as IEEE 754 halves: halves returns where, or NULL for
 * others. On a tape without gradients the floats of such a weight are never read; its address is its name. For tapes
 * that share packed weights too. */
typedef const void *(*ag_halves)(const float *weight, void *user);
void ag_halves_from(ag_tape *tape, ag_halves halves, void *user);
const void *ag_half(ag_tape *tape, const float *weight); /* what halves returns of it */

/* A scope for a tape without gradients: ag_scope_end gives back what was allocated since begin, except that the values
 * in keep[0 .. count-1] survive (they are moved; the pointers in keep are updated). On a tape with gradients both do
 * nothing. */
ts_mark ag_scope_begin(ag_tape *tape);
void ag_scope_end(ag_tape *tape, ts_mark mark, ag_value **keep, int count);
#endif
