/* A model's or any other tensors to a file of either form; it has its name when it is complete. */
#include "nn/weights/file_internal.h"
#include <stdlib.h>
#include <string.h>

/* The folder of the file that path is, or leads to; NULL: no memory. */
static char *real_folder(const char *path)
{
    char *real = realpath(path, NULL), *folder = ts_folder_of(real ? real : path);
    free(real);
    return folder;
}

ts_code nn_file_write(const char *path, nn_form form, const nn_tensor *tensor, int tensors, nn_dtype real,
                      const nn_meta *meta, int metas, bool (*stop)(void), ts_status *st)
{
    ts_new_file o;
    if (form == NN_FORM_TORCH_OLD) return ts_fail(st, TS_INVALID, "%s: PyTorch's old form is not written", path);
    char *folder = real_folder(path);
    if (!folder) return ts_fail(st, TS_NOMEM, "%s: no memory to write it", path);
    ts_sweep(folder);
    ts_code code = ts_new_file_begin(&o, path, st);
    if (!code) {
        code = (form == NN_FORM_TORCH_ZIP ? nn_torch_put : nn_safetensors_put)(&o, tensor, tensors, real, meta, metas,
                                                                               stop, st);
        code = ts_new_file_end(&o, code, st);
        /* makes the rename itself survive a power failure */
        const int error = code ? 0 : ts_sync_folder(folder);
        if (error) code = ts_fail(st, TS_IO, "%s: cannot sync its folder: %s", path, strerror(error));
    }
    free(folder);
    return code;
}
