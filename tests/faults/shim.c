/* A library for LD_PRELOAD that makes one call fail: LGD_FAULT="CALL N" the N-th call of that name that the program
 * itself makes, "CALL N+" that and all later ones. LGD_FAULT_LIBRARIES=1: that the libraries of images and of zlib make
 * instead. LGD_FAULT_COUNT=FILE: writes at the end how many calls of each name there were. LGD_FAULT_MARK=FILE is made
 * when a call has failed so. tests/faults/main.c drives it. */
#include <dirent.h>
#include <dlfcn.h>
#include <errno.h>
#include <fcntl.h>
#include <link.h>
#include <locale.h>
#include <pthread.h>
#include <stdarg.h>
#include <stdatomic.h>
#include <stdbool.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/mman.h>
#include <sys/stat.h>
#include <sys/syscall.h>
#include <unistd.h>

enum {
#define FAULT(name, error) CALL_##name,
#include "tests/faults/calls.h"
#undef FAULT
    COUNT
};
static const struct {
    const char *name;
    int error;
} table[COUNT] = {
#define FAULT(name, error) {#name, error},
#include "tests/faults/calls.h"
#undef FAULT
};

static _Atomic long calls[COUNT];
static int chosen = -1;
static long number;
static bool on;
enum { RANGES = 16 };
static struct {
    uintptr_t first, last;
} meant[RANGES]; /* the code whose calls can fail */
static int ranges;

static int find_code(struct dl_phdr_info *info, size_t size, void *libraries)
{
    (void)size;
    static const char *const names[] = {"/libpng", "/libjpeg", "/libz.", "/libOpenEXRCore"};
    bool found = !libraries;
    for (size_t i = 0; libraries && i < sizeof names / sizeof *names; i++)
        found |= strstr(info->dlpi_name, names[i]) != NULL;
    for (int i = 0; i < info->dlpi_phnum && found && ranges < RANGES; i++) {
        const ElfW(Phdr) *p = &info->dlpi_phdr[i];
        if (p->p_type != PT_LOAD || !(p->p_flags & PF_X)) continue;
        meant[ranges].first = info->dlpi_addr + p->p_vaddr;
        meant[ranges++].last = info->dlpi_addr + p->p_vaddr + p->p_memsz;
    }
    return !libraries; /* the program is the first */
}

__attribute__((constructor)) static void begin(void)
{
    dl_iterate_phdr(find_code, getenv("LGD_FAULT_LIBRARIES"));
    const char *text = getenv("LGD_FAULT");
    for (int i = 0; text && i < COUNT; i++) {
        const size_t n = strlen(table[i].name);
        if (strncmp(text, table[i].name, n) != 0 || text[n] != ' ') continue;
        chosen = i;
        number = atol(text + n);
        on = strchr(text, '+') != NULL;
    }
}

__attribute__((destructor)) static void end(void)
{
    const char *path = getenv("LGD_FAULT_COUNT");
    const int fd = path ? (int)syscall(SYS_openat, AT_FDCWD, path, O_WRONLY | O_CREAT | O_TRUNC, 0600) : -1;
    char line[64];
    for (int i = 0; i < COUNT && fd >= 0; i++)
        if (calls[i])
            syscall(SYS_write, fd, line, snprintf(line, sizeof line, "%s %ld\n", table[i].name, (long)calls[i]));
}

static bool fails(int call, const void *caller)
{
    bool found = false;
    for (int i = 0; i < ranges; i++) found |= (uintptr_t)caller >= meant[i].first && (uintptr_t)caller < meant[i].last;
    if (!found) return false;
    const long n = ++calls[call];
    if (call != chosen || (on ? n < number : n != number)) return false;
    const char *mark = getenv("LGD_FAULT_MARK");
    if (mark) syscall(SYS_close, syscall(SYS_openat, AT_FDCWD, mark, O_WRONLY | O_CREAT, 0600));
    errno = table[call].error;
    return true;
}

#define FAILS(name) fails(CALL_##name, __builtin_return_address(0))
#define REAL(name, type, ...)                  \
    static type (*real)(__VA_ARGS__);          \
    if (!real) {                               \
        void *found = dlsym(RTLD_NEXT, #name); \
        memcpy(&real, &found, sizeof real);    \
    }
/* Calls that only return something else. */
#define CALL1(type, name, bad, A)           \
    type name(A a)                          \
    {                                       \
        REAL(name, type, A)                 \
        return FAILS(name) ? bad : real(a); \
    }
#define CALL2(type, name, bad, A, B)           \
    type name(A a, B b)                        \
    {                                          \
        REAL(name, type, A, B)                 \
        return FAILS(name) ? bad : real(a, b); \
    }
#define CALL3(type, name, bad, A, B, C)           \
    type name(A a, B b, C c)                      \
    {                                             \
        REAL(name, type, A, B, C)                 \
        return FAILS(name) ? bad : real(a, b, c); \
    }
#define CALL4(type, name, bad, A, B, C, D)           \
    type name(A a, B b, C c, D d)                    \
    {                                                \
        REAL(name, type, A, B, C, D)                 \
        return FAILS(name) ? bad : real(a, b, c, d); \
    }

CALL3(ssize_t, read, -1, int, void *, size_t)
CALL4(ssize_t, pread, -1, int, void *, size_t, off_t)
CALL1(int, fsync, -1, int)
CALL2(int, rename, -1, const char *, const char *)
CALL2(int, ftruncate, -1, int, off_t)
CALL2(int, flock, -1, int, int)
CALL2(int, fstat, -1, int, struct stat *)
CALL2(int, stat, -1, const char *, struct stat *)
CALL2(int, lstat, -1, const char *, struct stat *)
CALL4(int, fstatat, -1, int, const char *, struct stat *, int)
CALL4(ssize_t, pwrite, -1, int, const void *, size_t, off_t)
CALL2(int, access, -1, const char *, int)
CALL2(int, mkdir, -1, const char *, mode_t)
CALL2(char *, realpath, NULL, const char *, char *)
CALL3(ssize_t, readlink, -1, const char *, char *, size_t)
CALL1(DIR *, opendir, NULL, const char *)
CALL1(DIR *, fdopendir, NULL, int)
CALL1(struct dirent *, readdir, NULL, DIR *)
CALL2(FILE *, fopen, NULL, const char *, const char *)
CALL2(FILE *, fdopen, NULL, int, const char *)
CALL3(int, fseek, -1, FILE *, long, int)
CALL1(long, ftell, -1, FILE *)
CALL1(char *, strdup, NULL, const char *)
CALL2(char *, strndup, NULL, const char *, size_t)
CALL2(FILE *, open_memstream, NULL, char **, size_t *)
CALL3(locale_t, newlocale, (locale_t)0, int, const char *, locale_t)
CALL3(int, setenv, -1, const char *, const char *, int)

typedef void (*ending)(void *);
typedef void *(*beginning)(void *);
CALL2(int, pthread_key_create, EAGAIN, pthread_key_t *, ending)
CALL2(int, pthread_setspecific, ENOMEM, pthread_key_t, const void *)
CALL4(int, pthread_create, EAGAIN, pthread_t *, const pthread_attr_t *, beginning, void *)

typedef int (*filter)(const struct dirent *);
typedef int (*order)(const struct dirent **, const struct dirent **);
CALL4(int, scandir, -1, const char *, struct dirent ***, filter, order)

int open(const char *path, int flags, ...)
{
    REAL(open, int, const char *, int, ...)
    va_list args;
    va_start(args, flags);
    const mode_t mode = flags & (O_CREAT | O_TMPFILE) ? va_arg(args, mode_t) : 0;
    va_end(args);
    return FAILS(open) ? -1 : real(path, flags, mode);
}

int openat(int folder, const char *path, int flags, ...)
{
    REAL(openat, int, int, const char *, int, ...)
    va_list args;
    va_start(args, flags);
    const mode_t mode = flags & (O_CREAT | O_TMPFILE) ? va_arg(args, mode_t) : 0;
    va_end(args);
    return FAILS(openat) ? -1 : real(folder, path, flags, mode);
}

/* Every command here has one number. */
int fcntl(int fd, int command, ...)
{
    REAL(fcntl, int, int, int, ...)
    va_list args;
    va_start(args, command);
    const long number_given = va_arg(args, long);
    va_end(args);
    return FAILS(fcntl) ? -1 : real(fd, command, number_given);
}

/* Messages go out, so that they can be judged. */
ssize_t write(int fd, const void *bytes, size_t size)
{
    REAL(write, ssize_t, int, const void *, size_t)
    if (fd != 2 && FAILS(write)) {
        if (size > 1) (void)!real(fd, bytes, size / 2); /* half of it is there, as on a disk that fills up */
        errno = ENOSPC;
        return -1;
    }
    return real(fd, bytes, size);
}

/* What fails to close is closed nevertheless. */
int close(int fd)
{
    REAL(close, int, int)
    const bool bad = FAILS(close);
    const int code = real(fd);
    if (bad) errno = EIO;
    return bad ? -1 : code;
}

int fclose(FILE *f)
{
    REAL(fclose, int, FILE *)
    const bool bad = FAILS(fclose);
    const int code = real(f);
    if (bad) errno = ENOSPC;
    return bad ? EOF : code;
}

void *mmap(void *at, size_t size, int protection, int flags, int fd, off_t offset)
{
    REAL(mmap, void *, void *, size_t, int, int, int, off_t)
    return FAILS(mmap) ? MAP_FAILED : real(at, size, protection, flags, fd, offset);
}

/* The stream's error is set as the C library would. */
static int stream_fails(FILE *f) { return f->_flags |= 0x20, EOF; }
#define STREAM_FAILS(name, f) ((f) != stderr && FAILS(name) && stream_fails(f))

int fflush(FILE *f)
{
    REAL(fflush, int, FILE *)
    return f && STREAM_FAILS(fflush, f) ? EOF : real(f);
}

size_t fread(void *to, size_t size, size_t count, FILE *f)
{
    REAL(fread, size_t, void *, size_t, size_t, FILE *)
    return STREAM_FAILS(fread, f) ? 0 : real(to, size, count, f);
}

char *fgets(char *to, int size, FILE *f)
{
    REAL(fgets, char *, char *, int, FILE *)
    return STREAM_FAILS(fgets, f) ? NULL : real(to, size, f);
}

size_t fwrite(const void *from, size_t size, size_t count, FILE *f)
{
    REAL(fwrite, size_t, const void *, size_t, size_t, FILE *)
    return STREAM_FAILS(fwrite, f) ? 0 : real(from, size, count, f);
}

int fputs(const char *text, FILE *f)
{
    REAL(fputs, int, const char *, FILE *)
    return STREAM_FAILS(fputs, f) ? EOF : real(text, f);
}

int fputc(int c, FILE *f)
{
    REAL(fputc, int, int, FILE *)
    return STREAM_FAILS(fputc, f) ? EOF : real(c, f);
}

int putc(int c, FILE *f)
{
    REAL(putc, int, int, FILE *)
    return STREAM_FAILS(putc, f) ? EOF : real(c, f);
}

int getc(FILE *f)
{
    REAL(getc, int, FILE *)
    return STREAM_FAILS(getc, f) ? EOF : real(f);
}

int puts(const char *text)
{
    REAL(puts, int, const char *)
    return STREAM_FAILS(puts, stdout) ? EOF : real(text);
}

int fprintf(FILE *f, const char *format, ...)
{
    va_list args;
    if (STREAM_FAILS(fprintf, f)) return -1;
    va_start(args, format);
    const int n = vfprintf(f, format, args);
    va_end(args);
    return n;
}

int printf(const char *format, ...)
{
    va_list args;
    if (STREAM_FAILS(printf, stdout)) return -1;
    va_start(args, format);
    const int n = vfprintf(stdout, format, args);
    va_end(args);
    return n;
}

int asprintf(char **text, const char *format, ...)
{
    va_list args;
    if (FAILS(asprintf)) return *text = NULL, -1;
    va_start(args, format);
    const int n = vasprintf(text, format, args);
    va_end(args);
    return n;
}

/* dlsym may ask for memory before there is anything to ask. */
static _Alignas(64) char early[4096];
static size_t early_used;
static void *from_early(size_t size)
{
    void *p = early + early_used;
    early_used += (size + 63) / 64 * 64;
    return early_used <= sizeof early ? p : NULL;
}

/* volatile: dlsym is declared to call nothing of ours */
static __thread volatile bool asking;
#define REAL_MEMORY(name, size, ...)              \
    static void *(*real)(__VA_ARGS__);            \
    if (!real && asking) return from_early(size); \
    if (!real) {                                  \
        asking = true;                            \
        void *found = dlsym(RTLD_NEXT, #name);    \
        memcpy(&real, &found, sizeof real);       \
        asking = false;                           \
    }

void *malloc(size_t size)
{
    REAL_MEMORY(malloc, size, size_t)
    return FAILS(malloc) ? NULL : real(size);
}

void *calloc(size_t count, size_t size)
{
    REAL_MEMORY(calloc, count * size, size_t, size_t)
    return FAILS(calloc) ? NULL : real(count, size);
}

void *realloc(void *old, size_t size)
{
    REAL_MEMORY(realloc, size, void *, size_t)
    return FAILS(realloc) ? NULL : real(old, size);
}

void *aligned_alloc(size_t align, size_t size)
{
    REAL_MEMORY(aligned_alloc, size, size_t, size_t)
    return FAILS(aligned_alloc) ? NULL : real(align, size);
}

void free(void *p)
{
    static void (*real)(void *);
    if ((char *)p >= early && (char *)p < early + sizeof early) return;
    if (!real && asking) return; /* what dlsym frees while it is asked */
    if (!real) {
        asking = true;
        void *found = dlsym(RTLD_NEXT, "free");
        memcpy(&real, &found, sizeof real);
        asking = false;
    }
    real(p);
}

void *dlopen(const char *path, int flags)
{
    REAL(dlopen, void *, const char *, int)
    return FAILS(dlopen) ? NULL : real(path, flags);
}
