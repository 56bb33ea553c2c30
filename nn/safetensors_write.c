/* The safetensors container (github.com/huggingface/safetensors, README, "Format"): u64 header size, JSON header, values, little endian. */
#include "nn/json.h"
#include "nn/weights.h"
#include <errno.h>
#include <fcntl.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#if __BYTE_ORDER__ != __ORDER_LITTLE_ENDIAN__
#error "weights files are little endian and are copied to and from memory as they are"
#endif

typedef struct text {
    char *data;
    size_t used, size;
    bool failed;
} text;

static char *room(text *t, size_t n)
{
    if (t->failed) return NULL;
    if (t->size - t->used < n) {
        size_t size = (t->size + n) * 2;
        char *data = realloc(t->data, size);
        if (!data) {
            t->failed = true;
            return NULL;
        }
        t->data = data;
        t->size = size;
    }
    t->used += n;
    return t->data + t->used - n;
}

static void put(text *t, const char *s)
{
    char *to = room(t, strlen(s));
    if (to) memcpy(to, s, strlen(s));
}

/* false: s is not UTF-8. */
static bool put_string(text *t, const char *s)
{
    int64_t n = json_escape(s, NULL);
    if (n < 0) return false;
    put(t, "\"");
    char *to = room(t, (size_t)n);
    if (to) json_escape(s, to);
    put(t, "\"");
    return true;
}

static int64_t block_count(const nn_block *b)
{
    int64_t count = 1;
    for (int i = 0; i < b->rank; i++) count *= b->dim[i];
    return count;
}

static ts_code make_header(text *t, const char *path, const nn_block *blocks, int count, const nn_meta *meta, int metas, ts_status *st)
{
    int64_t at = 0;
    char number[64];
    memset(room(t, 8), 0, 8);
    put(t, "{");
    if (metas > 0) put(t, "\"__metadata__\":{");
    for (int i = 0; i < metas; i++) {
        if (i) put(t, ",");
        bool good = put_string(t, meta[i].key);
        put(t, ":");
        if (!good || !put_string(t, meta[i].value)) return ts_fail(st, TS_INVALID, "%s: metadata \"%.80s\" is not UTF-8", path, meta[i].key);
    }
    if (metas > 0) put(t, count ? "}," : "}");
    for (int i = 0; i < count; i++) {
        const nn_block *b = &blocks[i];
        if (i) put(t, ",");
        if (!put_string(t, b->name)) return ts_fail(st, TS_INVALID, "%s: the tensor name \"%.80s\" is not UTF-8", path, b->name);
        put(t, ":{\"dtype\":\"F32\",\"shape\":[");
        for (int j = 0; j < b->rank; j++) {
            snprintf(number, sizeof number, "%s%lld", j ? "," : "", (long long)b->dim[j]);
            put(t, number);
        }
        int64_t end = at + 4 * block_count(b);
        snprintf(number, sizeof number, "],\"data_offsets\":[%lld,%lld]}", (long long)at, (long long)end);
        put(t, number);
        at = end;
    }
    put(t, "}");
    while (!t->failed && t->used % 64) put(t, " "); /* the values begin at a cache line of the mapped file */
    if (t->failed) return ts_fail(st, TS_NOMEM, "%s: no memory for the header", path);
    uint64_t size = t->used - 8;
    memcpy(t->data, &size, 8);
    return TS_OK;
}

static bool write_all(int fd, const void *data, size_t size)
{
    const char *p = data;
    while (size > 0) {
        ssize_t n = write(fd, p, size < 1u << 30 ? size : 1u << 30);
        if (n < 0 && errno == EINTR) continue;
        if (n <= 0) return false;
        p += n;
        size -= (size_t)n;
    }
    return true;
}

/* Makes the rename itself survive a power failure. A file system that cannot sync a folder says EINVAL: nothing to be done. */
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

ts_code nn_safetensors_write(const char *path, const nn_block *blocks, int count, const nn_meta *meta, int metas, ts_status *st)
{
    text t = {malloc(4096), 0, 4096, false};
    char *temporary = malloc(strlen(path) + 32);
    int fd = -1;
    ts_code code = TS_OK;
    if (!t.data || !temporary) code = ts_fail(st, TS_NOMEM, "%s: no memory to write it", path);
    if (!code) code = make_header(&t, path, blocks, count, meta, metas, st);
    if (!code) {
        sprintf(temporary, "%s.%ld", path, (long)getpid()); /* two processes that write the same file do not meet */
        fd = open(temporary, O_WRONLY | O_CREAT | O_TRUNC | O_NOFOLLOW | O_CLOEXEC, 0666);
        if (fd < 0) code = ts_fail(st, TS_IO, "%s: cannot write here: %s", path, strerror(errno));
    }
    if (fd >= 0) {
        bool good = write_all(fd, t.data, t.used);
        for (int i = 0; i < count && good; i++) good = write_all(fd, blocks[i].data, (size_t)block_count(&blocks[i]) * sizeof(float));
        good = good && fsync(fd) == 0;
        int error = errno;
        if (close(fd) != 0 && good) {
            good = false;
            error = errno;
        }
        if (good && rename(temporary, path) != 0) {
            good = false;
            error = errno;
        }
        if (!good) {
            unlink(temporary);
            code = ts_fail(st, TS_IO, "%s: cannot write it: %s", path, strerror(error));
        } else if (!sync_folder(path, temporary)) code = ts_fail(st, TS_IO, "%s: cannot sync its folder: %s", path, strerror(errno));
    }
    free(t.data);
    free(temporary);
    return code;
}
