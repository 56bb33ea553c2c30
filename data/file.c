#include "data/file.h"
#include "tensor/new_file.h"
#include <errno.h>
#include <fcntl.h>
#include <stdint.h>
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
    int fd = open(path, O_RDONLY | O_NONBLOCK | O_CLOEXEC); /* a pipe is refused, not waited for */
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

ts_code io_write_bytes(const char *path, const void *bytes, size_t size, ts_status *st)
{
    ts_new_file f;
    ts_code code = ts_new_file_begin(&f, path, st);
    if (code) return code;
    ts_new_file_put(&f, bytes, size);
    return ts_new_file_end(&f, TS_OK, st);
}
