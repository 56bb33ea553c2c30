/* The whitelist: every global that a pickle may name, and the value that it becomes. Nothing is executed. */
#include "nn/weights/torch.h"
#include <string.h>

typedef enum function { ORDERED_DICT = 1, TENSOR, TENSOR_V2, TENSOR_V3, PARAMETER, SIZE, STORAGE, DTYPE } function;

static const struct {
    const char *name; /* of a storage without "torch." or "torch.cuda." before and "Storage" behind it */
    nn_dtype dtype;
} storages[] = {{"Float", NN_F32}, {"Double", NN_F64}, {"Half", NN_F16},        {"BFloat16", NN_BF16},
                {"Long", NN_I64},  {"Int", NN_I32},    {"Short", NN_I16},       {"Char", NN_I8},
                {"Byte", NN_U8},   {"Bool", NN_BOOL},  {"ComplexFloat", NN_C64}},
  dtypes[] = {{"float32", NN_F32}, {"float64", NN_F64}, {"float16", NN_F16},         {"bfloat16", NN_BF16},
              {"int64", NN_I64},   {"int32", NN_I32},   {"int16", NN_I16},           {"int8", NN_I8},
              {"uint8", NN_U8},    {"bool", NN_BOOL},   {"complex64", NN_C64},       {"uint16", NN_U16},
              {"uint32", NN_U32},  {"uint64", NN_U64},  {"float8_e5m2", NN_F8_E5M2}, {"float8_e4m3fn", NN_F8_E4M3}};

static const struct {
    const char *name;
    function f;
} functions[] = {{"collections.OrderedDict", ORDERED_DICT},
                 {"torch._utils._rebuild_tensor", TENSOR},
                 {"torch._utils._rebuild_tensor_v2", TENSOR_V2},
                 {"torch._utils._rebuild_tensor_v3", TENSOR_V3},
                 {"torch._utils._rebuild_parameter", PARAMETER},
                 {"torch._utils._rebuild_parameter_with_state", PARAMETER},
                 {"torch.Size", SIZE}};

static bool global(pickle *p, const char *name, pk_value *out)
{
    (void)p;
    for (size_t i = 0; i < sizeof functions / sizeof *functions; i++)
        if (!strcmp(name, functions[i].name)) {
            out->tag = functions[i].f;
            return true;
        }
    if (!strcmp(name, "torch.storage.UntypedStorage") || !strcmp(name, "torch.UntypedStorage")) {
        out->tag = STORAGE;
        out->number = NN_U8;
        return true;
    }
    if (strncmp(name, "torch.", 6) != 0) return false;
    name += 6;
    for (size_t i = 0; i < sizeof dtypes / sizeof *dtypes; i++)
        if (!strcmp(name, dtypes[i].name)) {
            out->tag = DTYPE;
            out->number = dtypes[i].dtype;
            return true;
        }
    if (!strncmp(name, "cuda.", 5)) name += 5;
    for (size_t i = 0; i < sizeof storages / sizeof *storages; i++) {
        size_t n = strlen(storages[i].name);
        if (!strncmp(name, storages[i].name, n) && !strcmp(name + n, "Storage")) {
            out->tag = STORAGE;
            out->number = storages[i].dtype;
            return true;
        }
    }
    return false;
}

static bool all_ints(const pk_value *v, int64_t *out)
{
    if ((v->kind != PK_TUPLE && v->kind != PK_LIST) || v->length > NN_RANK_MAX) return false;
    for (uint32_t i = 0; i < v->length; i++) {
        if (v->item[i]->kind != PK_INT || v->item[i]->number < 0) return false;
        out[i] = v->item[i]->number;
    }
    return true;
}

/* (storage, offset, size, stride, …); the type is the storage's, or stands in seventh place where that is only bytes.
 */
static pk_value *tensor(pickle *p, const pk_value *a, function f)
{
    if (a->length < (f == TENSOR          ? 4u
                         : f == TENSOR_V2 ? 6u
                                          : 7u) ||
        a->item[0]->kind != PK_OBJECT || a->item[0]->tag != TORCH_STORAGE || a->item[1]->kind != PK_INT ||
        a->item[1]->number < 0)
        return pk_fail(p, "a tensor without storage or offset");
    torch_tensor *t = pk_take(p, sizeof *t);
    pk_value *v = t ? pk_new(p, PK_OBJECT) : NULL;
    if (!v) return NULL;
    v->tag = TORCH_TENSOR;
    v->object = t;
    t->storage = a->item[0]->object;
    t->dtype = t->storage->dtype;
    t->offset = a->item[1]->number;
    t->rank = (int)a->item[2]->length;
    if (!all_ints(a->item[2], t->dim)) return pk_fail(p, "a tensor whose shape is not up to 8 whole numbers");
    if (!all_ints(a->item[3], t->stride) || a->item[3]->length != a->item[2]->length)
        return pk_fail(p, "a tensor whose strides are not as many whole numbers, none negative, as its shape has");
    if (f != TENSOR_V3) return v;
    if (a->item[6]->kind != PK_GLOBAL || a->item[6]->tag != DTYPE) return pk_fail(p, "a tensor without a type");
    t->dtype = (nn_dtype)a->item[6]->number;
    return v;
}

/* OrderedDict(), or of one list of pairs as Python 2 wrote it. */
static pk_value *ordered_dict(pickle *p, const pk_value *a)
{
    pk_value *d = pk_new(p, PK_DICT);
    if (!d || a->length == 0) return d;
    const pk_value *pairs = a->item[0];
    if (a->length != 1 || pairs->kind != PK_LIST)
        return pk_fail(p, "an OrderedDict of something else than a list of pairs");
    if (!(d->item = pk_take(p, (2 * (size_t)pairs->length + 1) * sizeof *d->item))) return NULL;
    for (uint32_t i = 0; i < pairs->length; i++) {
        const pk_value *pair = pairs->item[i];
        if ((pair->kind != PK_LIST && pair->kind != PK_TUPLE) || pair->length != 2)
            return pk_fail(p, "an OrderedDict of something else than pairs");
        d->item[d->length++] = pair->item[0];
        d->item[d->length++] = pair->item[1];
    }
    d->capacity = d->length;
    return d;
}

static pk_value *call(pickle *p, const pk_value *g, pk_value *a)
{
    switch (g->tag) {
    case ORDERED_DICT: return ordered_dict(p, a);
    case TENSOR:
    case TENSOR_V2:
    case TENSOR_V3: return tensor(p, a, (function)g->tag);
    case PARAMETER:
        if (a->length < 1 || a->item[0]->kind != PK_OBJECT || a->item[0]->tag != TORCH_TENSOR)
            return pk_fail(p, "a parameter that is no tensor");
        return a->item[0];
    case SIZE:
        if (a->length != 1 || (a->item[0]->kind != PK_TUPLE && a->item[0]->kind != PK_LIST))
            return pk_fail(p, "a torch.Size that is no tuple");
        return a->item[0];
    default: return pk_fail(p, "a call of a type");
    }
}

/* ("storage", type, key, where it was, numbers[, (view's key, offset, numbers)]) */
static pk_value *persistent(pickle *p, const pk_value *id)
{
    const bool right = id->kind == PK_TUPLE && id->length >= 5 && pk_is_text(id->item[0], "storage") &&
        id->item[1]->kind == PK_GLOBAL && id->item[1]->tag == STORAGE && id->item[2]->kind == PK_TEXT &&
        id->item[4]->kind == PK_INT && id->item[4]->number >= 0;
    if (!right) return pk_fail(p, "a persistent object that is no storage");
    torch_storage *s = pk_take(p, sizeof *s);
    pk_value *v = s ? pk_new(p, PK_OBJECT) : NULL;
    if (!v) return NULL;
    v->tag = TORCH_STORAGE;
    v->object = s;
    *s = (torch_storage){id->item[2]->text,  id->item[2]->length, (nn_dtype)id->item[1]->number, id->item[4]->number, 0,
                         id->item[4]->number};
    const pk_value *view = id->length > 5 ? id->item[5] : NULL;
    if (!view || view->kind == PK_NONE) return v;
    if (view->kind != PK_TUPLE || view->length != 3 || view->item[1]->kind != PK_INT || view->item[2]->kind != PK_INT)
        return pk_fail(p, "a view of a storage without offset and size");
    s->view_offset = view->item[1]->number;
    s->view_size = view->item[2]->number;
    if (s->view_offset < 0 || s->view_size < 0 || s->view_offset > s->numel || s->view_size > s->numel - s->view_offset)
        return pk_fail(p, "a view that lies outside its storage");
    return v;
}

const pk_hooks torch_hooks = {global, call, persistent};
