#include "nn/weights/pickle.h"
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

void *pk_fail(pickle *p, const char *format, ...)
{
    char text[400];
    va_list args;
    va_start(args, format);
    vsnprintf(text, sizeof text, format, args);
    va_end(args);
    if (!p->failed) ts_fail(p->st, TS_FORMAT, "%s: %s, byte %zu: %s", p->path, p->part, p->at, text);
    p->failed = true;
    return NULL;
}

static void *no_memory(pickle *p)
{
    if (!p->failed) ts_fail(p->st, TS_NOMEM, "%s: no memory for %s", p->path, p->part);
    p->failed = true;
    return NULL;
}

void *pk_take(pickle *p, size_t bytes)
{
    enum { POOL = 1 << 16 };
    bytes = (bytes + 7) & ~(size_t)7;
    if (bytes > POOL / 4) {
        void *large = ts_arena_zalloc(p->arena, bytes, 1);
        return large ? large : no_memory(p);
    }
    if (bytes > p->pool_left) {
        p->pool = ts_arena_zalloc(p->arena, POOL, 1);
        p->pool_left = p->pool ? POOL : 0;
        if (!p->pool) return no_memory(p);
    }
    p->pool_left -= bytes;
    return p->pool + p->pool_left;
}

pk_value *pk_new(pickle *p, pk_kind kind)
{
    pk_value *v = pk_take(p, sizeof *v);
    if (v) v->kind = kind;
    return v;
}

bool pk_is_text(const pk_value *v, const char *text)
{
    return v->kind == PK_TEXT && v->length == strlen(text) && memcmp(v->text, text, v->length) == 0;
}

const char *pk_printable(const char *text, size_t length, char *out, size_t size)
{
    size_t n = 0;
    for (; n < length && n + 1 < size; n++) out[n] = text[n] >= ' ' && text[n] <= '~' ? text[n] : '?';
    out[n] = 0;
    return out;
}

/* Makes space for one more item of size bytes in an array on the heap. */
static bool reserve(pickle *p, void *array, uint32_t count, uint32_t *capacity, size_t size)
{
    void **a = array;
    if (count < *capacity) return true;
    uint32_t wanted = *capacity ? 2 * *capacity : 64;
    void *grown = realloc(*a, wanted * size);
    if (!grown) return no_memory(p);
    *a = grown;
    *capacity = wanted;
    return true;
}

static void push(pickle *p, pk_value *v)
{
    if (v && reserve(p, &p->stack, p->depth, &p->stack_capacity, sizeof *p->stack)) p->stack[p->depth++] = v;
}

/* Where the stack begins that opcodes without a mark may take from. */
static uint32_t floor_of(const pickle *p) { return p->marks ? p->mark[p->marks - 1] : 0; }

static pk_value *pop(pickle *p)
{
    if (p->depth <= floor_of(p)) return pk_fail(p, "nothing is left on the stack");
    return p->stack[--p->depth];
}

static pk_value *top(pickle *p)
{
    if (p->depth <= floor_of(p)) return pk_fail(p, "nothing is left on the stack");
    return p->stack[p->depth - 1];
}

/* Unsigned, little endian. */
static uint64_t number(pickle *p, int bytes)
{
    uint64_t v = 0;
    if (p->size - p->at < (size_t)bytes) {
        pk_fail(p, "truncated");
        return 0;
    }
    for (int i = bytes; i-- > 0;) v = v << 8 | p->data[p->at + (size_t)i];
    p->at += (size_t)bytes;
    return v;
}

static void push_int(pickle *p, int64_t value)
{
    pk_value *v = p->failed ? NULL : pk_new(p, PK_INT);
    if (!v) return;
    v->number = value;
    push(p, v);
}

static void push_text(pickle *p, pk_kind kind, uint64_t length)
{
    if (p->failed) return;
    if (length > p->size - p->at) {
        pk_fail(p, "truncated");
        return;
    }
    pk_value *v = pk_new(p, kind);
    if (!v) return;
    v->text = (const char *)p->data + p->at;
    v->length = (uint32_t)length;
    p->at += length;
    push(p, v);
}

/* A long integer: a number where it fits into 64 bits, otherwise its bytes. */
static void push_long(pickle *p, uint64_t bytes)
{
    if (p->failed || bytes > 8) {
        push_text(p, PK_BYTES, bytes);
        return;
    }
    uint64_t v = number(p, (int)bytes);
    if (bytes && bytes < 8 && v >> (8 * bytes - 1)) v |= UINT64_MAX << 8 * bytes; /* two's complement */
    push_int(p, (int64_t)v);
}

static bool append(pickle *p, pk_value *list, pk_value *item)
{
    if (list->length == list->capacity) {
        uint32_t wanted = list->capacity ? 2 * list->capacity : 8;
        pk_value **grown = pk_take(p, wanted * sizeof *grown);
        if (!grown) return false;
        if (list->length) memcpy(grown, list->item, list->length * sizeof *grown);
        list->item = grown;
        list->capacity = wanted;
    }
    list->item[list->length++] = item;
    return true;
}

static void push_tuple(pickle *p, uint32_t count)
{
    if (p->depth - floor_of(p) < count) {
        pk_fail(p, "nothing is left on the stack");
        return;
    }
    pk_value *v = pk_new(p, PK_TUPLE);
    if (v && count && !(v->item = pk_take(p, count * sizeof *v->item))) return;
    if (!v) return;
    v->length = v->capacity = count;
    p->depth -= count;
    if (count) memcpy(v->item, p->stack + p->depth, count * sizeof *v->item);
    push(p, v);
}

/* The last mark goes; returns how many values stand above it. */
static uint32_t pop_mark(pickle *p)
{
    if (!p->marks) {
        pk_fail(p, "a mark is missing");
        return 0;
    }
    return p->depth - p->mark[--p->marks];
}

/* The count values on top go into the list or dict below them. */
static void extend(pickle *p, uint32_t count, pk_kind kind)
{
    if (p->failed) return;
    if (p->depth < floor_of(p) + count + 1 || p->stack[p->depth - count - 1]->kind != kind ||
        (kind == PK_DICT && count % 2)) {
        pk_fail(p, "items for something that is no %s", kind == PK_DICT ? "dictionary" : "list");
        return;
    }
    pk_value *to = p->stack[p->depth - count - 1];
    for (uint32_t i = 0; i < count; i++)
        if (!append(p, to, p->stack[p->depth - count + i])) return;
    p->depth -= count;
}

static void put_memo(pickle *p, uint64_t i)
{
    pk_value *v = top(p);
    if (!v) return;
    if (i > 2 * (uint64_t)p->memos + 1024) { /* picklers count up; anything else would only cost memory */
        pk_fail(p, "a memo with the number %llu", (unsigned long long)i);
        return;
    }
    while (p->memos <= i) {
        if (!reserve(p, &p->memo, p->memos, &p->memo_capacity, sizeof *p->memo)) return;
        p->memo[p->memos++] = NULL;
    }
    p->memo[i] = v;
}

static void get_memo(pickle *p, uint64_t i)
{
    if (p->failed) return;
    if (i >= p->memos || !p->memo[i]) pk_fail(p, "nothing was memorised as number %llu", (unsigned long long)i);
    else push(p, p->memo[i]);
}

static void push_global(pickle *p, const char *module, size_t module_length, const char *name, size_t name_length)
{
    char full[128], shown[128];
    if (p->failed) return;
    pk_value *v = pk_new(p, PK_GLOBAL);
    if (!v) return;
    bool whole = module_length < 60 && name_length < 60;
    if (whole) {
        memcpy(full, module, module_length);
        full[module_length] = '.';
        memcpy(full + module_length + 1, name, name_length);
        full[module_length + 1 + name_length] = 0;
    }
    if (whole && strlen(full) == module_length + 1 + name_length && p->hooks->global(p, full, v)) {
        push(p, v);
        return;
    }
    char shown_module[60];
    pk_printable(module, module_length, shown_module, sizeof shown_module);
    pk_printable(name, name_length, shown, 60);
    pk_fail(p,
            "it needs %s.%s, which is not one of the globals that rebuild tensors; nothing is executed here. Save the "
            "state dict alone: "
            "torch.save(model.state_dict(), FILE)",
            shown_module, shown);
}

/* Two lines of text. */
static void global_lines(pickle *p)
{
    const char *line[2];
    size_t length[2];
    for (int i = 0; i < 2; i++) {
        line[i] = (const char *)p->data + p->at;
        const char *end = memchr(line[i], '\n', p->size - p->at);
        if (!end) {
            pk_fail(p, "truncated");
            return;
        }
        length[i] = (size_t)(end - line[i]);
        p->at += length[i] + 1;
    }
    push_global(p, line[0], length[0], line[1], length[1]);
}

static void stack_global(pickle *p)
{
    pk_value *name = pop(p), *module = name ? pop(p) : NULL;
    if (!module) return;
    if (name->kind != PK_TEXT || module->kind != PK_TEXT) pk_fail(p, "a global whose name is no text");
    else push_global(p, module->text, module->length, name->text, name->length);
}

static void call(pickle *p)
{
    pk_value *arguments = pop(p), *global = arguments ? pop(p) : NULL;
    if (!global) return;
    if (global->kind != PK_GLOBAL || arguments->kind != PK_TUPLE) pk_fail(p, "a call of something that is no global");
    else push(p, p->hooks->call(p, global, arguments));
}

/* Attributes: an OrderedDict may have some (a state dict's version numbers); nothing else here has. */
static void build(pickle *p)
{
    pk_value *state = pop(p), *of = state ? top(p) : NULL;
    if (!of) return;
    if (of->kind != PK_DICT || state->kind != PK_DICT) pk_fail(p, "attributes of something that is no dictionary");
    else of->state = state;
}

static void persistent(pickle *p)
{
    pk_value *id = pop(p);
    if (id) push(p, p->hooks->persistent(p, id));
}

/* One opcode; names as in pickletools.py. */
static void step(pickle *p, int op)
{
    pk_value *v;
    switch (op) {
    case 0x80: number(p, 1); break; /* PROTO */
    case 0x95: number(p, 8); break; /* FRAME */
    case 'N': push(p, pk_new(p, PK_NONE)); break;
    case 0x88:
    case 0x89: /* NEWTRUE, NEWFALSE */
        if ((v = pk_new(p, PK_BOOL))) v->number = op == 0x88;
        push(p, v);
        break;
    case 'K': push_int(p, (int64_t)number(p, 1)); break;
    case 'M': push_int(p, (int64_t)number(p, 2)); break;
    case 'J': push_int(p, (int32_t)number(p, 4)); break;
    case 0x8a: push_long(p, number(p, 1)); break; /* LONG1 */
    case 'G':                                     /* BINFLOAT: no number of a tensor is one */
        number(p, 8);
        push(p, p->failed ? NULL : pk_new(p, PK_FLOAT));
        break;
    case 'X':
    case 'T': push_text(p, PK_TEXT, number(p, 4)); break; /* BINUNICODE, BINSTRING */
    case 0x8c:
    case 'U': push_text(p, PK_TEXT, number(p, 1)); break; /* SHORT_BINUNICODE, SHORT_BINSTRING */
    case 'B': push_text(p, PK_BYTES, number(p, 4)); break;
    case 'C': push_text(p, PK_BYTES, number(p, 1)); break;
    case ']': push(p, pk_new(p, PK_LIST)); break;
    case '}': push(p, pk_new(p, PK_DICT)); break;
    case ')': push_tuple(p, 0); break;
    case 0x85:
    case 0x86:
    case 0x87: push_tuple(p, (uint32_t)op - 0x84); break; /* TUPLE1 … 3 */
    case '(':
        if (reserve(p, &p->mark, p->marks, &p->mark_capacity, sizeof *p->mark)) p->mark[p->marks++] = p->depth;
        break;
    case 't': {
        uint32_t count = pop_mark(p);
        if (!p->failed) push_tuple(p, count);
        break;
    }
    case 'a': extend(p, 1, PK_LIST); break;
    case 's': extend(p, 2, PK_DICT); break;
    case 'e':
    case 'u': {
        uint32_t count = pop_mark(p);
        extend(p, count, op == 'e' ? PK_LIST : PK_DICT);
        break;
    }
    case 'q': put_memo(p, number(p, 1)); break;
    case 'r': put_memo(p, number(p, 4)); break;
    case 0x94: put_memo(p, p->memos); break; /* MEMOIZE */
    case 'h': get_memo(p, number(p, 1)); break;
    case 'j': get_memo(p, number(p, 4)); break;
    case 'c': global_lines(p); break;
    case 0x93: stack_global(p); break;
    case 'R':
    case 0x81: call(p); break; /* REDUCE, NEWOBJ */
    case 'b': build(p); break;
    case 'Q': persistent(p); break;
    default: pk_fail(p, "the opcode 0x%02x, which no state dict needs", (unsigned)op);
    }
}

pk_value *pk_read(pickle *p)
{
    const size_t begin = p->at;
    p->failed = false;
    p->stack = p->memo = NULL;
    p->mark = NULL;
    p->depth = p->stack_capacity = p->memos = p->memo_capacity = p->marks = p->mark_capacity = 0;
    pk_value *result = NULL;
    if (p->at >= p->size || p->data[p->at] != 0x80) pk_fail(p, "no pickle of protocol 2 or later");
    while (!p->failed) {
        if (p->at >= p->size) pk_fail(p, "truncated");
        else if (p->at - begin >= PK_MOST_BYTES) pk_fail(p, "more than 4 MiB: at most that is read");
        else if (p->data[p->at] == '.') {
            p->at++;
            if (p->marks || p->depth != 1) pk_fail(p, "it ends with %u values", p->depth);
            else result = p->stack[0];
            break;
        } else step(p, p->data[p->at++]);
    }
    free(p->stack);
    free(p->memo);
    free(p->mark);
    p->stack = p->memo = NULL;
    p->mark = NULL;
    return p->failed ? NULL : result;
}
