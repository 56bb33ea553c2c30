#include "tensor/new_file.h"
#include <dirent.h>
#include <errno.h>
#include <fcntl.h>
#include <stdbool.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <time.h>
#include <unistd.h>

enum { DAY = 24 * 60 * 60, NAME = 80 };

/* A hash (FNV-1a) of the kernel's number for this boot; 0: it has none. */
static uint32_t this_boot(void)
{
    char id[64];
    const int fd = open("/proc/sys/kernel/random/boot_id", O_RDONLY | O_CLOEXEC);
    const ssize_t n = fd < 0 ? 0 : read(fd, id, sizeof id);
    if (fd >= 0) close(fd);
    uint32_t h = n > 0 ? 2166136261u : 0;
    for (ssize_t i = 0; i < n; i++) h = (h ^ (unsigned char)id[i]) * 16777619u;
    return h;
}

static void hidden_name(char name[NAME], uint32_t boot, long process, int number)
{
    snprintf(name, NAME, ".lgd-%08x-%ld-%d.tmp", (unsigned)boot, process, number);
}

static bool is_same(const struct stat *a, const struct stat *b)
{
    return a->st_dev == b->st_dev && a->st_ino == b->st_ino;
}

static int make_folder(const char *path)
{
    if (mkdir(path, 0777) != 0) return -1;
    const int fd = open(path, O_RDONLY | O_DIRECTORY | O_CLOEXEC);
    if (fd >= 0) return fd;
    const int error = errno == ENOENT ? EEXIST : errno; /* gone: another process's sweep took it */
    rmdir(path);
    return errno = error, -1;
}

/* Locks what fd is open for. 0: path still names it; EEXIST: another process's sweep came before the lock; or errno. */
static int lock_made(int fd, const char *path)
{
    struct stat made, named;
    if (flock(fd, LOCK_EX | LOCK_NB) != 0 && errno == EWOULDBLOCK) return EEXIST;
    if (fstat(fd, &made) != 0) return errno;
    if (lstat(path, &named) != 0) return errno == ENOENT ? EEXIST : errno;
    return is_same(&made, &named) ? 0 : EEXIST;
}

/* A locked new file or folder in folder; a descriptor, or -1 and errno. *path: malloced; NULL after a failure. The name
 * does not grow with that of the final file, which may be as long as the system allows. */
static int make_hidden(const char *folder, bool is_folder, char **path)
{
    static int counter;
    char name[NAME];
    for (int tries = 0; tries < 1000; tries++) {
        hidden_name(name, this_boot(), (long)getpid(), __atomic_add_fetch(&counter, 1, __ATOMIC_RELAXED));
        if (asprintf(path, "%s/%s", folder, name) < 0) {
            *path = NULL;
            return errno = ENOMEM, -1;
        }
        const int fd = is_folder ? make_folder(*path) : open(*path, O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, 0666);
        const int error = fd < 0 ? errno : lock_made(fd, *path);
        if (!error) return fd;
        if (fd >= 0 && error != EEXIST) remove(*path); /* ours, and nobody's to come back for */
        if (fd >= 0) close(fd);
        free(*path);
        *path = NULL;
        errno = error;
        if (error != EEXIST) return -1; /* else another name */
    }
    return -1;
}

char *ts_folder_of(const char *path)
{
    const char *slash = strrchr(path, '/');
    return !slash ? strdup(".") : slash == path ? strdup("/") : strndup(path, (size_t)(slash - path));
}

ts_code ts_path_in(char path[TS_PATH_LENGTH], const char *folder, const char *name, ts_status *st)
{
    if (snprintf(path, TS_PATH_LENGTH, "%s/%s", folder, name) >= TS_PATH_LENGTH)
        return ts_fail(st, TS_INVALID, "%.200s...: the name is too long", folder);
    return TS_OK;
}

ts_code ts_move_file(const char *from, const char *to, const char *name, ts_status *st)
{
    char old[TS_PATH_LENGTH], path[TS_PATH_LENGTH];
    if (ts_path_in(old, from, name, st) != TS_OK || ts_path_in(path, to, name, st) != TS_OK) return st->code;
    return rename(old, path) == 0 ? TS_OK : ts_fail(st, TS_IO, "%s: cannot be replaced: %s", path, strerror(errno));
}

ts_code ts_new_file_begin(ts_new_file *f, const char *name, ts_status *st)
{
    struct stat info;
    *f = (ts_new_file){.name = name, .fd = -1};
    const bool there = stat(name, &info) == 0;
    if (there && S_ISDIR(info.st_mode)) return ts_fail(st, TS_IO, "%s: is a folder", name);
    if (there && !S_ISREG(info.st_mode)) {
        f->fd = open(name, O_WRONLY | O_CLOEXEC);
        return f->fd >= 0 ? TS_OK : ts_fail(st, TS_IO, "%s: cannot be written: %s", name, strerror(errno));
    }
    f->path = there ? realpath(name, NULL) : NULL;
    if (!f->path) f->path = strdup(name);
    char *folder = f->path ? ts_folder_of(f->path) : NULL;
    if (!folder) {
        free(f->path);
        return ts_fail(st, TS_NOMEM, "%s: no memory to write it", name);
    }
    f->fd = make_hidden(folder, false, &f->temporary);
    const ts_code code = f->fd >= 0
        ? TS_OK
        : ts_fail(st, TS_IO, "%s: cannot write into the folder %s: %s", name, folder, strerror(errno));
    free(folder);
    if (code) free(f->path);
    return code;
}

void ts_new_file_put(ts_new_file *f, const void *data, size_t size)
{
    const char *p = data;
    f->written += (int64_t)size;
    while (size > 0 && !f->error) {
        const ssize_t n = write(f->fd, p, size < 1u << 30 ? size : 1u << 30);
        if (n < 0 && errno == EINTR) continue;
        if (n <= 0) {
            f->error = n < 0 ? errno : EIO;
            return;
        }
        p += n;
        size -= (size_t)n;
    }
}

ts_code ts_new_file_end(ts_new_file *f, ts_code code, ts_status *st)
{
    /* some file systems have no sync */
    if (f->temporary && !code && !f->error && fsync(f->fd) != 0 && errno != EINVAL && errno != ENOTSUP)
        f->error = errno;
    /* renamed while it is open, and so locked: a sweep never sees it without its lock */
    if (f->temporary && !code && !f->error && rename(f->temporary, f->path) != 0) f->error = errno;
    if (f->temporary && (code || f->error)) unlink(f->temporary);
    if (close(f->fd) != 0 && !f->error) f->error = errno;
    if (!code && f->error) code = ts_fail(st, TS_IO, "%s: cannot be written: %s", f->name, strerror(f->error));
    free(f->temporary);
    free(f->path);
    *f = (ts_new_file){.fd = -1};
    return code;
}

ts_code ts_hidden_folder(const char *parent, char **path, int *lock, ts_status *st)
{
    *lock = make_hidden(parent, true, path);
    return *lock >= 0 ? TS_OK : ts_fail(st, TS_IO, "%s: nothing can be written there: %s", parent, strerror(errno));
}

/* The files in the folder that fd is open for. */
static void empty_folder(int fd)
{
    const int copy = openat(fd, ".", O_RDONLY | O_DIRECTORY | O_CLOEXEC);
    DIR *d = copy < 0 ? NULL : fdopendir(copy);
    if (copy >= 0 && !d) close(copy);
    for (const struct dirent *e; d && (e = readdir(d));) unlinkat(fd, e->d_name, 0);
    if (d) closedir(d);
}

void ts_hidden_folder_remove(const char *path, int *lock)
{
    empty_folder(*lock);
    rmdir(path);
    close(*lock);
    *lock = -1;
}

int ts_sync_folder(const char *folder)
{
    const int fd = open(folder, O_RDONLY | O_DIRECTORY | O_CLOEXEC);
    if (fd < 0) return errno == EACCES ? 0 : errno; /* a folder that can be written but not read */
    const int error = fsync(fd) == 0 || errno == EINVAL || errno == ENOTSUP ? 0 : errno;
    close(fd);
    return error;
}

/* name, in the folder of d, is a hidden one that was made under boot. */
static void sweep_one(int d, const char *name, uint32_t boot)
{
    struct stat info, named;
    int fd = openat(d, name, O_RDWR | O_NOFOLLOW | O_NONBLOCK | O_CLOEXEC); /* NFS locks what can be written */
    if (fd < 0) fd = openat(d, name, O_RDONLY | O_NOFOLLOW | O_NONBLOCK | O_CLOEXEC);
    if (fd < 0) return;
    const int error = flock(fd, LOCK_EX | LOCK_NB) != 0 ? errno : 0;
    const bool dead = !error && boot && boot == this_boot();
    if (error != EWOULDBLOCK && fstat(fd, &info) == 0 && (dead || time(NULL) - info.st_mtime > DAY) &&
        fstatat(d, name, &named, AT_SYMLINK_NOFOLLOW) == 0 && is_same(&info, &named)) { /* not just renamed */
        if (S_ISDIR(info.st_mode)) {
            empty_folder(fd);
            unlinkat(d, name, AT_REMOVEDIR);
        } else if (S_ISREG(info.st_mode)) unlinkat(d, name, 0);
    }
    close(fd);
}

void ts_sweep(const char *folder)
{
    DIR *d = opendir(folder);
    for (const struct dirent *e; d && (e = readdir(d));) {
        unsigned boot;
        long process;
        int number;
        char name[NAME];
        if (sscanf(e->d_name, ".lgd-%8x-%ld-%d.tmp", &boot, &process, &number) != 3) continue;
        hidden_name(name, boot, process, number);
        if (strcmp(name, e->d_name) == 0) sweep_one(dirfd(d), name, boot);
    }
    if (d) closedir(d);
}
