#include "nn/weights/weights.h"
#include "tests/fuzz/fuzz.h"
#include <stdlib.h>
#include <string.h>

/* Everything that a user of the file would touch; where a tensor is small, its numbers too. */
static void use(nn_file *f)
{
    enum { MOST = 1 << 16 };
    static double as_is[MOST];
    static float real[MOST];
    for (int i = 0; nn_file_meta_key(f, i); i++)
        if (strlen(nn_file_meta(f, nn_file_meta_key(f, i))) > 1 << 30) abort(); /* reads all of it */
    for (int i = 0; i < nn_file_count(f); i++) {
        const nn_tensor *e = nn_file_tensor(f, i);
        if (nn_file_find(f, e->name) != e) abort();
        if (e->count > MOST) continue;
        nn_tensor_copy(e, e->dtype, as_is);
        if (nn_file_read(f, e->name, e->rank, e->dim, real, NULL)) continue;
        nn_tensor_copy(e, NN_F16, as_is);
        nn_tensor_copy(e, NN_BF16, as_is);
    }
}

static void run(nn_file *(*open_file)(const char *, ts_status *), const uint8_t *data, size_t size)
{
    ts_status st = {0};
    nn_file *f = open_file(fuzz_file(data, size), &st);
    if (!f && (!st.code || !*st.message || strchr(st.message, '\n'))) abort(); /* a failure has one line */
    if (f) use(f);
    nn_file_close(&f);
}

void fuzz_safetensors(const uint8_t *data, size_t size) { run(nn_safetensors_open, data, size); }
void fuzz_torch(const uint8_t *data, size_t size) { run(nn_file_open, data, size); }
