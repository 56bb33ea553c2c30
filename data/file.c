#include "data/file.h"
#include <errno.h>
#include <fcntl.h>
#include <limits.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

ts_code io_check_file(const char *path, ts_status *st)
{
    struct stat info;
    if (stat(path, &info)) return ts_fail(st, TS_IO, "%s: %s", path, strerror(errno));
    if (S_ISDIR(info.st_mode)) return ts_fail(st, TS_IO, "%s: is a folder, not a file", path);
    if (!S_ISREG(info.st_mode)) return ts_fail(st, TS_IO, "%s: not a regular file", path);
    if (info.st_size == 0) return ts_fail(st, TS_FORMAT, "%s: empty file", path);
    int fd = open(path, O_RDONLY | O_CLOEXEC);
    if (fd < 0) return ts_fail(st, TS_IO, "%s: %s", path, strerror(errno));
    close(fd);
    return TS_OK;
}

ts_code io_read_bytes(const char *path, size_t limit, char **bytes, size_t *size, ts_status *st)
{
    int fd = open(path, O_RDONLY | O_CLOEXEC);
    if (fd < 0) return ts_fail(st, TS_IO, "%s: %s", path, strerror(errno));
    struct stat info;
    if (fstat(fd, &info) || !S_ISREG(info.st_mode)) {
        close(fd);
        return ts_fail(st, TS_IO, "%s: not a regular file", path);
    }
    if ((uint64_t)info.st_size > limit) {
        close(fd);
        return ts_fail(st, TS_UNSUPPORTED, "%s: longer than %zu bytes", path, limit);
    }
    size_t length = (size_t)info.st_size, done = 0;
    char *text = malloc(length + 1);
    while (text && done < length) {
        ssize_t n = read(fd, text + done, length - done);
        if (n < 0 && errno == EINTR) continue;
        if (n <= 0) break;
        done += (size_t)n;
    }
    close(fd);
    if (!text) return ts_fail(st, TS_NOMEM, "%s: no memory for %zu bytes", path, length);
    if (done < length) {
        free(text);
        return ts_fail(st, TS_IO, "%s: could not be read to its end", path);
    }
    text[length] = 0;
    *bytes = text;
    *size = length;
    return TS_OK;
}

static int write_all(int fd, const char *bytes, size_t size)
{
    while (size) {
        ssize_t n = write(fd, bytes, size);
        if (n < 0 && errno == EINTR) continue;
        if (n < 0) return errno;
        if (n == 0) return EIO;
        bytes += n;
        size -= (size_t)n;
    }
    return 0;
}

static ts_code write_directly(const char *path, const void *bytes, size_t size, ts_status *st)
{
    int fd = open(path, O_WRONLY | O_CLOEXEC), error;
    if (fd < 0) return ts_fail(st, TS_IO, "%s: %s", path, strerror(errno));
    error = write_all(fd, bytes, size);
    if (close(fd) && !error) error = errno;
    return error ? ts_fail(st, TS_IO, "%s: %s", path, strerror(error)) : TS_OK;
}

void io_sync_folder(const char *folder)
{
    int fd = open(folder, O_RDONLY | O_DIRECTORY | O_CLOEXEC);
    if (fd < 0) return;
    (void)!fsync(fd);
    close(fd);
}

static ts_code replace(const char *name, const char *path, const void *bytes, size_t size, ts_status *st)
{
    char folder[PATH_MAX], temporary[PATH_MAX + 64];
    const char *slash = strrchr(path, '/');
    size_t length = slash ? (size_t)(slash - path) : 0;
    if (length >= sizeof folder) return ts_fail(st, TS_INVALID, "%s: name too long", name);
    memcpy(folder, path, length);
    folder[length] = 0;
    if (!slash) strcpy(folder, ".");
    else if (!length) strcpy(folder, "/");
    /* The temporary name does not grow with the file's own, which may be as long as the system allows. */
    static int counter;
    int fd = -1;
    for (int tries = 0; fd < 0 && tries < 100; tries++) {
        snprintf(temporary, sizeof temporary, "%s/.lgd-%ld-%d.tmp", folder, (long)getpid(),
                 __atomic_add_fetch(&counter, 1, __ATOMIC_RELAXED));
        fd = open(temporary, O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, 0666);
        if (fd < 0 && errno != EEXIST) break;
    }
    if (fd < 0) return ts_fail(st, TS_IO, "%s: cannot write into the folder %s: %s", name, folder, strerror(errno));
    int error = write_all(fd, bytes, size);
    if (!error && fsync(fd) && errno != EINVAL && errno != ENOTSUP) error = errno; /* some file systems have no sync */
    if (close(fd) && !error) error = errno;
    if (!error && rename(temporary, path)) error = errno;
    if (error) {
        unlink(temporary);
        return ts_fail(st, TS_IO, "%s: %s", name, strerror(error));
    }
    return TS_OK;
}

ts_code io_write_bytes(const char *path, const void *bytes, size_t size, ts_status *st)
{
    struct stat info;
    char *real = NULL;
    if (!stat(path, &info)) {
        if (S_ISDIR(info.st_mode)) return ts_fail(st, TS_IO, "%s: is a folder", path);
        if (!S_ISREG(info.st_mode)) return write_directly(path, bytes, size, st);
        real = realpath(path, NULL);
    }
    ts_code code = replace(path, real ? real : path, bytes, size, st);
    free(real);
    return code;
}
