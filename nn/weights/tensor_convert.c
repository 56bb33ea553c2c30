/* The numbers of a tensor, from whatever type, order and layout they have in a file. */
#include "nn/weights/file_internal.h"
#include "tensor/kernels/elementwise.h"
#include "tensor/team.h"
#include <math.h>
#include <stdatomic.h>
#include <stdlib.h>
#include <string.h>

#if __BYTE_ORDER__ != __ORDER_LITTLE_ENDIAN__
#error "weights files are little endian and are copied to and from memory as they are"
#endif

static const struct {
    const char *name;
    int size;
} types[NN_DTYPES] = {{"F32", 4},  {"F16", 2},     {"BF16", 2},    {"F64", 8}, {"I64", 8}, {"U64", 8},
                      {"I32", 4},  {"U32", 4},     {"I16", 2},     {"U16", 2}, {"I8", 1},  {"U8", 1},
                      {"BOOL", 1}, {"F8_E5M2", 1}, {"F8_E4M3", 1}, {"C64", 8}};

const char *nn_dtype_name(nn_dtype dtype) { return types[dtype].name; }
int nn_dtype_size(nn_dtype dtype) { return types[dtype].size; }
bool nn_dtype_real(nn_dtype dtype) { return dtype <= NN_F64; }
nn_dtype nn_dtype_out(nn_dtype has, nn_dtype real) { return real < NN_DTYPES && nn_dtype_real(has) ? real : has; }

static uint16_t take16(const unsigned char *p, bool swapped)
{
    uint16_t v;
    memcpy(&v, p, 2);
    return swapped ? __builtin_bswap16(v) : v;
}

static uint32_t take32(const unsigned char *p, bool swapped)
{
    uint32_t v;
    memcpy(&v, p, 4);
    return swapped ? __builtin_bswap32(v) : v;
}

static uint64_t take64(const unsigned char *p, bool swapped)
{
    uint64_t v;
    memcpy(&v, p, 8);
    return swapped ? __builtin_bswap64(v) : v;
}

static float as_float(uint32_t bits)
{
    float f;
    memcpy(&f, &bits, 4);
    return f;
}

static uint32_t as_bits(float f)
{
    uint32_t bits;
    memcpy(&bits, &f, 4);
    return bits;
}

/* binary32 to binary16, to nearest, ties to even. A finite number from 65520 on becomes infinite and *overflow true. */
static uint16_t to_half(float f, bool *overflow)
{
    uint32_t bits = as_bits(f), sign = bits >> 16 & 0x8000, size = bits & 0x7fffffff;
    if (size > 0x7f800000) return (uint16_t)(sign | 0x7e00);
    if (size >= 0x477ff000) { /* 65520 */
        if (size < 0x7f800000) *overflow = true;
        return (uint16_t)(sign | 0x7c00);
    }
    if (size < 0x38800000) /* below 2^-14: subnormal; adding 0.5 leaves multiples of 2^-24 in the fraction, rounded by
                              the addition */
        return (uint16_t)(sign | (as_bits(as_float(size) + 0.5f) & 0x7fff));
    size += 0xfff + (size >> 13 & 1);
    return (uint16_t)(sign | (size - (112u << 23)) >> 13);
}

/* binary32 to its upper half, to nearest, ties to even. */
static uint16_t to_brain(float f)
{
    uint32_t bits = as_bits(f);
    if ((bits & 0x7fffffff) > 0x7f800000) return (uint16_t)(bits >> 16 | 0x40); /* a NaN stays one */
    return (uint16_t)((bits + 0x7fff + (bits >> 16 & 1)) >> 16);
}

enum { CHUNK = 1024 };

static bool all_finite(const float *v, int n)
{
    int bad = 0;
    for (int i = 0; i < n; i++) bad |= (as_bits(v[i]) & 0x7f800000) == 0x7f800000;
    return !bad;
}

/* The same of halves, whose exponents are compared as they are, 16 bits each. */
static bool all_finite_half(const unsigned char *p, int64_t n)
{
    const int16_t exponent = 0x7c00;
    int16_t largest = 0;
    for (int64_t i = 0; i < n; i++) {
        int16_t v;
        memcpy(&v, p + 2 * i, 2);
        v &= exponent;
        largest = v > largest ? v : largest;
    }
    return largest < exponent;
}

static void load(const nn_tensor *e, const unsigned char *p, int64_t step, int n, float *out)
{
    uint16_t half[CHUNK];
    switch (e->dtype) {
    case NN_F16:
        if (step == 2 && !e->swapped) { /* as the models that ship are */
            ts_elementwise_k()->from_half(n, p, out);
            break;
        }
        for (int i = 0; i < n; i++, p += step) half[i] = take16(p, e->swapped);
        ts_elementwise_k()->from_half(n, half, out);
        break;
    case NN_BF16:
        for (int i = 0; i < n; i++, p += step) out[i] = as_float((uint32_t)take16(p, e->swapped) << 16);
        break;
    case NN_F64:
        for (int i = 0; i < n; i++, p += step) {
            uint64_t bits = take64(p, e->swapped);
            double d;
            memcpy(&d, &bits, 8);
            out[i] = (float)d;
        }
        break;
    default:
        if (step == 4 && !e->swapped) memcpy(out, p, sizeof *out * (size_t)n);
        else
            for (int i = 0; i < n; i++, p += step) out[i] = as_float(take32(p, e->swapped));
    }
}

static bool store(const float *in, nn_dtype to, int n, unsigned char *out)
{
    bool overflow = false;
    for (int i = 0; i < n; i++) {
        double d = in[i];
        uint16_t h = to == NN_F16 ? to_half(in[i], &overflow) : to == NN_BF16 ? to_brain(in[i]) : 0;
        if (to == NN_F64) memcpy(out + 8 * i, &d, 8);
        else memcpy(out + 2 * i, &h, 2);
    }
    return !overflow;
}

static void copy_as_is(const nn_tensor *e, const unsigned char *p, int64_t step, int64_t n, unsigned char *out)
{
    int size = types[e->dtype].size;
    if (step == size && !e->swapped) {
        memcpy(out, p, (size_t)(n * size));
        return;
    }
    int part = e->dtype == NN_C64 ? 4 : size; /* bytes that are swapped together */
    for (int64_t i = 0; i < n; i++, p += step)
        for (int j = 0; j < size; j++) *out++ = p[e->swapped ? j / part * part + part - 1 - j % part : j];
}

/* Dimensions that follow each other in memory become one, those of length 1 none. Returns the rank that is left, at
 * least 1. */
static int collapse(const nn_tensor *e, int64_t *dim, int64_t *stride)
{
    int n = 0;
    for (int i = 0; i < e->rank; i++) {
        if (e->dim[i] == 1) continue;
        if (n && stride[n - 1] == e->stride[i] * e->dim[i]) {
            dim[n - 1] *= e->dim[i];
            stride[n - 1] = e->stride[i];
        } else {
            dim[n] = e->dim[i];
            stride[n++] = e->stride[i];
        }
    }
    if (!n) dim[0] = stride[0] = n = 1;
    return n;
}

bool nn_tensor_plain(const nn_tensor *e)
{
    int64_t dim[NN_RANK_MAX], stride[NN_RANK_MAX];
    if (e->count == 0) return true;
    int n = collapse(e, dim, stride);
    return n == 1 && (stride[0] == 1 || dim[0] == 1) && (!e->swapped || types[e->dtype].size == 1);
}

typedef struct conversion {
    const nn_tensor *e;
    const unsigned char *from;
    int64_t step, run;
    nn_dtype to;
    unsigned char *out;
    bool finite; /* whether it is asked */
    atomic_bool *good, *all;
} conversion;

static void convert_chunks(const void *job, int64_t begin, int64_t end)
{
    const conversion *c = job;
    for (int64_t i = begin; i < end; i += CHUNK) {
        float part[CHUNK];
        const int m = (int)(end - i < CHUNK ? end - i : CHUNK);
        unsigned char *out = c->out + i * types[c->to].size;
        float *there = c->to == NN_F32 ? (float *)(void *)out : part;
        load(c->e, c->from + i * c->step, c->step, m, there);
        if (c->finite && !all_finite(there, m)) atomic_store(c->all, false); /* while it is in the first cache */
        if (c->to != NN_F32 && !store(part, c->to, m, out)) atomic_store(c->good, false);
    }
}

/* finite: NULL, or false where a number is not, as F32 (to). */
static bool copy(const nn_tensor *e, nn_dtype to, void *out, bool *finite)
{
    int64_t dim[NN_RANK_MAX], stride[NN_RANK_MAX], at[NN_RANK_MAX] = {0};
    if (e->count == 0) return true;
    const unsigned char *p = e->data;
    unsigned char *o = out;
    const int n = collapse(e, dim, stride), size = types[e->dtype].size;
    const int64_t step = stride[n - 1] * size, run = dim[n - 1];
    atomic_bool good = true, all = true;
    for (int j = 0; j >= 0;) {
        const bool as_is = to == e->dtype && !finite;
        if (as_is) copy_as_is(e, p, step, run, o);
        else
            ts_for(run > 64 * CHUNK ? 0 : 1, run, CHUNK, convert_chunks,
                   &(conversion){e, p, step, run, to, o, finite != NULL, &good, &all});
        o += run * types[to].size;
        for (j = n - 2; j >= 0 && ++at[j] == dim[j]; j--) { /* to the next run, like an odometer */
            at[j] = 0;
            p -= (dim[j] - 1) * stride[j] * size;
        }
        if (j >= 0) p += stride[j] * size;
    }
    if (finite) *finite = all;
    return good;
}

bool nn_tensor_copy(const nn_tensor *e, nn_dtype to, void *out) { return copy(e, to, out, NULL); }

bool nn_tensor_finite(const nn_tensor *e, float *out)
{
    bool finite = true;
    copy(e, NN_F32, out, &finite);
    return finite;
}

const void *nn_tensor_halves(const nn_tensor *e)
{
    return e->dtype == NN_F16 && e->count && nn_tensor_plain(e) ? e->data : NULL;
}

bool nn_halves_finite(const nn_tensor *e) { return all_finite_half(e->data, e->count); }

const void *nn_tensor_bytes(const nn_tensor *e, nn_dtype to, const char *path, void **work, size_t *work_size,
                            ts_status *st)
{
    int64_t bytes;
    if (to == e->dtype && nn_tensor_plain(e)) return e->count ? (const void *)e->data : "";
    if (__builtin_mul_overflow(e->count, types[to].size, &bytes)) bytes = INT64_MAX;
    if ((size_t)bytes > *work_size) {
        free(*work);
        *work = malloc((size_t)bytes);
        *work_size = *work ? (size_t)bytes : 0;
        if (!*work) {
            ts_fail(st, TS_NOMEM, "%s: no memory for tensor \"%.200s\"", path, e->name);
            return NULL;
        }
    }
    if (nn_tensor_copy(e, to, *work)) return *work;
    ts_fail(st, TS_NUMERIC,
            "%s: not written: tensor \"%.200s\" has numbers that are too large for F16 (65504): take BF16 or F32", path,
            e->name);
    return NULL;
}
