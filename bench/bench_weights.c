/* Weights of the published network's size, 640 MB in PyTorch's form, from the page cache into memory. The file lies in
 * $TMPDIR or /tmp meanwhile. */
#include "bench/bench.h"
#include "nn/weights/file.h"
#include "tensor/memory.h"
#include <stdio.h>
#include <stdlib.h>
#include <unistd.h>

enum { TENSORS = 20, SIDE = 2829 }; /* 160 million numbers */

typedef struct subject {
    char path[256];
    float *block;
    ts_status st;
} subject;

static void load(void *user)
{
    subject *s = user;
    nn_file *f = nn_file_open(s->path, &s->st);
    for (int i = 0; f && i < nn_file_count(f); i++) {
        const nn_tensor *e = nn_file_tensor(f, i);
        nn_file_read(f, e->name, e->rank, e->dim, s->block + (size_t)i * SIDE * SIDE, &s->st);
    }
    nn_file_close(&f);
}

BENCH(weights)
{
    static char names[TENSORS][8];
    const char *folder = getenv("TMPDIR");
    subject s = {.block = ts_memory((size_t)TENSORS * SIDE * SIDE * sizeof(float))};
    nn_tensor entry[TENSORS];
    bench_heading("Weights files of 160 million numbers, from the page cache");
    for (int i = 0; s.block && i < TENSORS * SIDE * SIDE; i++) s.block[i] = (float)(i % 1000) * 1e-3f;
    for (int i = 0; i < TENSORS; i++) {
        snprintf(names[i], sizeof names[i], "w%d", i);
        entry[i] = (nn_tensor){names[i],
                               NN_F32,
                               false,
                               2,
                               {SIDE, SIDE},
                               {SIDE, 1},
                               (int64_t)SIDE * SIDE,
                               (const unsigned char *)(s.block + (size_t)i * SIDE * SIDE)};
    }
    static const nn_dtype type[] = {NN_F32, NN_F16, NN_BF16};
    for (int k = 0; s.block && k < 3; k++) {
        char label[80];
        snprintf(s.path, sizeof s.path, "%s/lgd-bench-%ld.pth", folder && *folder ? folder : "/tmp", (long)getpid());
        if (nn_file_write(s.path, NN_FORM_TORCH_ZIP, entry, TENSORS, type[k], NULL, 0, NULL, &s.st) == TS_OK) {
            const bench_time t = bench_measure(load, &s);
            snprintf(label, sizeof label, "open a .pth of %s and read it as floats", nn_dtype_name(type[k]));
            if (!s.st.code)
                bench_row_unit(label, t, 1e-9 * TENSORS * SIDE * SIDE * nn_dtype_size(type[k]) / t.seconds, "GB/s");
        }
        if (s.st.code) printf("  %s\n", s.st.message);
        unlink(s.path);
    }
    free(s.block);
}
