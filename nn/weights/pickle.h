/* A reader of Python pickles (pickletools.py, protocols 2 to 5) that executes nothing: it knows the opcodes of a
 * state dict, and its caller defines the globals and the results of calling them. An unknown opcode or global is an
 * error. */
#ifndef NN_PICKLE_H
#define NN_PICKLE_H
#include "tensor/arena.h"
#include <stdbool.h>
#include <stdint.h>

enum { PK_MOST_BYTES = 4 << 20 }; /* of one pickle; what it needs in memory is at most some fifty times that */

typedef enum pk_kind {
    PK_NONE,
    PK_BOOL,
    PK_INT,
    PK_FLOAT,
    PK_TEXT,
    PK_BYTES,
    PK_TUPLE,
    PK_LIST,
    PK_DICT,
    PK_GLOBAL,
    PK_OBJECT
} pk_kind;

typedef struct pk_value {
    pk_kind kind;
    int tag;         /* the caller's, of PK_GLOBAL and PK_OBJECT */
    uint32_t length; /* of text and bytes; items of a tuple or list; 2 * pairs of a dict: key, value, key, value, … */
    uint32_t capacity;
    union {
        int64_t number;   /* PK_INT, PK_BOOL, PK_GLOBAL */
        const char *text; /* PK_TEXT and PK_BYTES: in the pickle, no 0 at its end */
        struct pk_value **item;
        void *object;
    };
    struct pk_value *state; /* what BUILD gave to a dict, or NULL */
} pk_value;

typedef struct pickle pickle;

/* NULL after pk_fail. */
typedef struct pk_hooks {
    bool (*global)(pickle *p, const char *name,
                   pk_value *out); /* "module.name"; sets tag and number; false: unknown (p says so) */
    pk_value *(*call)(pickle *p, const pk_value *global, pk_value *arguments);
    pk_value *(*persistent)(pickle *p, const pk_value *id);
} pk_hooks;

struct pickle {
    const unsigned char *data;
    size_t size, at;
    const char *path, *part; /* for messages */
    const pk_hooks *hooks;
    void *user;
    ts_arena *arena; /* what values live in */
    ts_status *st;
    bool failed;
    unsigned char *pool; /* small values come from here */
    size_t pool_left;
    pk_value **stack, **memo;
    uint32_t *mark;
    uint32_t depth, stack_capacity, memos, memo_capacity, marks, mark_capacity;
};

/* Reads one pickle that begins at data + at; at is behind it afterwards. NULL and st on failure. */
pk_value *pk_read(pickle *p);

/* Sets "PATH: PART, byte AT: …". Always NULL. */
void *pk_fail(pickle *p, const char *format, ...) __attribute__((format(printf, 2, 3)));
/* A new value, zeroed; NULL after pk_fail. */
pk_value *pk_new(pickle *p, pk_kind kind);
void *pk_take(pickle *p, size_t bytes); /* memory from the arena, aligned to 8, zeroed */
bool pk_is_text(const pk_value *v, const char *text);
/* Copies text for a message: printable ASCII, the rest as '?'. */
const char *pk_printable(const char *text, size_t length, char *out, size_t size);
#endif
