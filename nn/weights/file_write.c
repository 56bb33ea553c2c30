/* A file replaces another one only when all of it is on the disk. */
#include "nn/weights/file_internal.h"
#include <errno.h>
#include <fcntl.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

ts_code nn_atomic_begin(nn_atomic_file *o, const char *path, ts_status *st)
{
    *o = (nn_atomic_file){.path = path, .temporary = malloc(strlen(path) + 32), .fd = -1};
    if (!o->temporary) return ts_fail(st, TS_NOMEM, "%s: no memory to write it", path);
    sprintf(o->temporary, "%s.%ld", path, (long)getpid()); /* two processes that write the same file do not meet */
    o->fd = open(o->temporary, O_WRONLY | O_CREAT | O_TRUNC | O_NOFOLLOW | O_CLOEXEC, 0666);
    if (o->fd >= 0) return TS_OK;
    ts_code code = ts_fail(st, TS_IO, "%s: cannot write here: %s", path, strerror(errno));
    free(o->temporary);
    o->temporary = NULL;
    return code;
}

void nn_atomic_put(nn_atomic_file *o, const void *data, size_t size)
{
    const char *p = data;
    o->written += (int64_t)size;
    while (size > 0 && !o->error) {
        ssize_t n = write(o->fd, p, size < 1u << 30 ? size : 1u << 30);
        if (n < 0 && errno == EINTR) continue;
        if (n <= 0) {
            o->error = n < 0 ? errno : EIO;
            return;
        }
        p += n;
        size -= (size_t)n;
    }
}

/* Makes the rename itself survive a power failure. A file system that cannot sync a folder says EINVAL: nothing to be
 * done. */
static bool sync_folder(const char *path, char *folder)
{
    strcpy(folder, path);
    char *slash = strrchr(folder, '/');
    if (slash) slash[slash == folder] = 0;
    int fd = open(slash ? folder : ".", O_RDONLY | O_DIRECTORY | O_CLOEXEC);
    if (fd < 0) return errno == EACCES; /* a folder that can be written but not read */
    bool good = fsync(fd) == 0 || errno == EINVAL;
    close(fd);
    return good;
}

ts_code nn_atomic_end(nn_atomic_file *o, ts_code code, ts_status *st)
{
    if (!o->temporary) return code;
    if (!code && !o->error && fsync(o->fd) != 0) o->error = errno;
    if (close(o->fd) != 0 && !o->error) o->error = errno;
    if (!code && !o->error && rename(o->temporary, o->path) != 0) o->error = errno;
    if (code || o->error) unlink(o->temporary);
    if (!code && o->error) code = ts_fail(st, TS_IO, "%s: cannot write it: %s", o->path, strerror(o->error));
    else if (!code && !sync_folder(o->path, o->temporary))
        code = ts_fail(st, TS_IO, "%s: cannot sync its folder: %s", o->path, strerror(errno));
    free(o->temporary);
    o->temporary = NULL;
    return code;
}

ts_code nn_file_write(const char *path, nn_form form, const nn_tensor *tensor, int tensors, nn_dtype real,
                      const nn_meta *meta, int metas, ts_status *st)
{
    nn_atomic_file o;
    if (form == NN_FORM_TORCH_OLD) return ts_fail(st, TS_INVALID, "%s: PyTorch's old form is not written", path);
    ts_code code = nn_atomic_begin(&o, path, st);
    if (!code)
        code = (form == NN_FORM_TORCH_ZIP ? nn_torch_put : nn_safetensors_put)(&o, tensor, tensors, real, meta, metas,
                                                                               st);
    return nn_atomic_end(&o, code, st);
}
