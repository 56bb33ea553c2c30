/* A file of named tensors in any of the formats: the interface for everything that reads or writes weights. */
#ifndef NN_FILE_H
#define NN_FILE_H
#include "tensor/status.h"
#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

/* Types of numbers by safetensors' names. Weights can have the first four; the others may be in a file beside them. */
typedef enum nn_dtype {
    NN_F32,
    NN_F16,
    NN_BF16,
    NN_F64,
    NN_I64,
    NN_U64,
    NN_I32,
    NN_U32,
    NN_I16,
    NN_U16,
    NN_I8,
    NN_U8,
    NN_BOOL,
    NN_F8_E5M2,
    NN_F8_E4M3,
    NN_C64,
    NN_DTYPES
} nn_dtype;
const char *nn_dtype_name(nn_dtype dtype); /* "F32" … */
int nn_dtype_size(nn_dtype dtype);         /* bytes of a number */
bool nn_dtype_real(nn_dtype dtype);        /* one of the first four: can be read as floats */

enum { NN_RANK_MAX = 8 };

/* One tensor: number [i, j, …] lies at data + (i stride[0] + j stride[1] + …) nn_dtype_size(dtype), which is not
 * aligned to anything. */
typedef struct nn_tensor {
    const char *name; /* UTF-8, unique in its file */
    nn_dtype dtype;
    bool swapped; /* the numbers are big endian */
    int rank;
    int64_t dim[NN_RANK_MAX], stride[NN_RANK_MAX]; /* >= 0, in numbers */
    int64_t count;                                 /* the product of dim: 1 for rank 0 */
    const unsigned char *data;
} nn_tensor;

typedef enum nn_form { NN_FORM_SAFETENSORS, NN_FORM_TORCH_ZIP, NN_FORM_TORCH_OLD } nn_form;

/* A mapped, validated file: every tensor's numbers lie inside it, or in memory that it owns where they were compressed.
 * Everything in a file is checked. nn_file_open takes every form, recognised by its first bytes;
 * nn_safetensors_open takes that form alone, whose header has at most 16 MiB and whose tensors fill the rest of the
 * file without holes or overlap. NULL and st on failure; closing nulls the pointer. The functions below return
 * memory that lives until then. */
typedef struct nn_file nn_file;
nn_file *nn_file_open(const char *path, ts_status *st);
nn_file *nn_safetensors_open(const char *path, ts_status *st);
void nn_file_close(nn_file **file);

nn_form nn_file_form(const nn_file *file);
const char *nn_file_path(const nn_file *file); /* for messages */
int nn_file_count(const nn_file *file);
const nn_tensor *nn_file_tensor(const nn_file *file, int i); /* in the file's order */
const char *nn_file_name(const nn_file *file, int i);
const nn_tensor *nn_file_find(const nn_file *file, const char *name); /* NULL when absent */
bool nn_file_has(const nn_file *file, const char *name);
const char *nn_file_meta(const nn_file *file, const char *key); /* NULL when absent */
const char *nn_file_meta_key(const nn_file *file, int i);       /* in the file's order, NULL past the last */

/* Tensor name, which must have that shape; NULL and st otherwise, and where it is not of real numbers. */
const nn_tensor *nn_file_find_real(const nn_file *file, const char *name, int rank, const int64_t *dim, ts_status *st);
/* Of the file's bytes: what ts_hash_file says of it. */
uint64_t nn_file_hash(const nn_file *file);

/* Copies tensor name into out (as many floats as dim says, row-major); TS_FORMAT when it is missing, has another shape
 * or is not of real numbers. F64 is rounded. */
ts_code nn_file_read(const nn_file *file, const char *name, int rank, const int64_t *dim, float *out, ts_status *st);
/* And TS_NUMERIC when one is not finite. */
ts_code nn_file_read_finite(const nn_file *file, const char *name, int rank, const int64_t *dim, float *out,
                            ts_status *st);

/* Copies the numbers of e, row-major and little endian, into out (count * nn_dtype_size(to) bytes, aligned to one). to
 * is e's own type, or both are real; rounds to nearest even (F64 to a half by way of F32). False: a finite number is
 * too large for F16. */
bool nn_tensor_copy(const nn_tensor *e, nn_dtype to, void *out);
/* Of real numbers, as F32. False: one is not finite. */
bool nn_tensor_finite(const nn_tensor *e, float *out);
/* Row-major without gaps, little endian: data may be used as it is. */
bool nn_tensor_plain(const nn_tensor *e);
/* Its numbers where they are F16 in that order, not aligned; or NULL. And whether those are finite. */
const void *nn_tensor_halves(const nn_tensor *e);
bool nn_halves_finite(const nn_tensor *e);
/* "[64, 3, 3, 3]" */
void nn_shape_text(int rank, const int64_t *dim, char *out, size_t size);

typedef struct nn_meta {
    const char *key, *value;
} nn_meta;

/* Writes tensors in that form (not NN_FORM_TORCH_OLD) to a temporary file beside path, fsynced, renamed; nothing is
 * left on failure. real: the type that all tensors of real numbers get, NN_DTYPES to leave each as it is. Views of one
 * storage become tensors of their own. stop: asked before each tensor whether to go no further (TS_INTERRUPTED); may be
 * NULL. */
ts_code nn_file_write(const char *path, nn_form form, const nn_tensor *tensor, int tensors, nn_dtype real,
                      const nn_meta *meta, int metas, bool (*stop)(void), ts_status *st);
#endif
