#include "cli/infer/manifest.h"
#include "data/json.h"
#include "data/text.h"
#include "tensor/hash.h"
#include "tensor/new_file.h"
#include <errno.h>
#include <fcntl.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

/* Every line begins with HEAD and a JSON string, the name of the photograph's folder, which is its key. What begins
 * with TAIL says what was made; before it stands when and how long. */
#define HEAD "{\"folder\": "
#define TAIL ", \"hash\": "

typedef struct known {
    uint64_t key, tail; /* hashes; tail 0: the file has no line of this photograph, or that of a failure */
    bool there;
} known;

struct cl_manifest {
    char *path;
    int fd;
    known *photo; /* of the plan, by key */
    int photos;
};

/* The key of a line; 0: it is none of ours, and stays as it is. */
static uint64_t key_of(const char *line, size_t size)
{
    const size_t head = sizeof HEAD - 1;
    if (size < head + 4 || memcmp(line, HEAD "\"", head + 1) != 0 || memcmp(line + size - 2, "}\n", 2) != 0) return 0;
    size_t end = head + 1;
    while (end < size && line[end] != '"') end += line[end] == '\\' ? 2 : 1;
    return end < size ? ts_hash(line + head, end + 1 - head, 0) : 0;
}

static uint64_t tail_of(const char *line, size_t size)
{
    const char *tail = memmem(line, size, TAIL, sizeof TAIL - 1);
    return tail ? ts_hash(tail, (size_t)(line + size - tail), 0) : 0;
}

static int by_key(const void *a, const void *b)
{
    const known *x = a, *y = b;
    return (x->key > y->key) - (x->key < y->key);
}

static known *find(const cl_manifest *m, uint64_t key)
{
    return bsearch(&(known){.key = key}, m->photo, (size_t)m->photos, sizeof *m->photo, by_key);
}

/* The file as its name leads to it, locked against other writers where the file system can. Another process may have
 * put a new one in its place while this one waited. */
static ts_code hold(cl_manifest *m, ts_status *st)
{
    for (int tries = 0; tries < 1000; tries++) {
        struct stat held, named;
        if (m->fd < 0) m->fd = open(m->path, O_RDWR | O_CREAT | O_APPEND | O_CLOEXEC, 0666);
        if (m->fd < 0) return ts_fail(st, TS_IO, "%s: cannot be written: %s", m->path, strerror(errno));
        while (flock(m->fd, LOCK_EX) != 0 && errno == EINTR) continue;
        if (fstat(m->fd, &held) == 0 && stat(m->path, &named) == 0 && held.st_dev == named.st_dev &&
            held.st_ino == named.st_ino)
            return TS_OK;
        close(m->fd);
        m->fd = -1;
    }
    return ts_fail(st, TS_IO, "%s: is replaced again and again", m->path);
}

static void let_go(cl_manifest *m)
{
    if (m->fd >= 0) (void)!flock(m->fd, LOCK_UN);
}

/* Cuts off half a line that a killed process has left at the end, and ends one that is none of ours. The file is held.
 */
static ts_code cut(cl_manifest *m, off_t *size, ts_status *st)
{
    struct stat info;
    char c = '\n';
    if (fstat(m->fd, &info) != 0) return ts_fail(st, TS_IO, "%s: %s", m->path, strerror(errno));
    off_t end = info.st_size;
    while (end > 0 && pread(m->fd, &c, 1, end - 1) == 1 && c != '\n') end--;
    *size = end;
    if (end == info.st_size) return TS_OK;
    char head[sizeof HEAD - 1];
    const ssize_t n = pread(m->fd, head, sizeof head, end);
    const bool ours = n > 0 && memcmp(head, HEAD, (size_t)n) == 0 &&
        !(pread(m->fd, &c, 1, info.st_size - 1) == 1 && c == '}'); /* a whole one, as an editor leaves it */
    if (!ours) *size = info.st_size + 1;
    if (ours ? ftruncate(m->fd, end) != 0 : write(m->fd, "\n", 1) != 1)
        return ts_fail(st, TS_IO, "%s: cannot be written: %s", m->path, strerror(errno));
    return TS_OK;
}

typedef struct last {
    uint64_t key;
    int64_t line;
} last;

/* By key, the last line first. */
static int by_last(const void *a, const void *b)
{
    const last *x = a, *y = b;
    if (x->key != y->key) return x->key < y->key ? -1 : 1;
    return (x->line < y->line) - (x->line > y->line);
}

static int by_line(const void *a, const void *b)
{
    const last *x = a, *y = b;
    return (x->line > y->line) - (x->line < y->line);
}

typedef struct lines {
    last *of; /* every line, in its order; after keep_last the last of each key, and those that have none */
    int64_t count, capacity, all;
} lines;

/* What the lines are, and what of them is of the plan. */
static ts_code look(cl_manifest *m, FILE *f, lines *l, ts_status *st)
{
    char *line = NULL;
    size_t capacity = 0;
    ssize_t size;
    for (int i = 0; i < m->photos; i++) m->photo[i].there = false;
    while ((size = getline(&line, &capacity, f)) > 0) {
        const uint64_t key = key_of(line, (size_t)size);
        const int64_t number = l->all++;
        if (l->count == l->capacity) {
            const int64_t wider = l->capacity ? 2 * l->capacity : 1024;
            last *more = realloc(l->of, (size_t)wider * sizeof *more);
            if (!more) break;
            l->of = more;
            l->capacity = wider;
        }
        l->of[l->count++] = (last){key, number};
        known *k = key ? find(m, key) : NULL;
        if (k) k->there = true, k->tail = tail_of(line, (size_t)size);
    }
    const bool whole = feof(f) && !ferror(f);
    free(line);
    return whole ? TS_OK : ts_fail(st, TS_IO, "%s: cannot be read to its end", m->path);
}

static void keep_last(lines *l)
{
    int64_t n = 0;
    qsort(l->of, (size_t)l->count, sizeof *l->of, by_last);
    for (int64_t i = 0; i < l->count; i++)
        if (i == 0 || !l->of[i].key || l->of[i].key != l->of[i - 1].key) l->of[n++] = l->of[i];
    l->count = n;
    qsort(l->of, (size_t)n, sizeof *l->of, by_line);
}

/* A new file with the kept lines in place of the held one. */
static ts_code replace(cl_manifest *m, FILE *f, const lines *l, ts_status *st)
{
    ts_new_file to;
    char *line = NULL;
    size_t capacity = 0;
    ssize_t size;
    int64_t number = 0, kept = 0;
    if (ts_new_file_begin(&to, m->path, st) != TS_OK) return st->code;
    rewind(f);
    for (; kept < l->count && (size = getline(&line, &capacity, f)) > 0; number++)
        if (l->of[kept].line == number) ts_new_file_put(&to, line, (size_t)size), kept++;
    ts_code code = kept == l->count ? TS_OK : ts_fail(st, TS_IO, "%s: cannot be read to its end", m->path);
    free(line);
    return ts_new_file_end(&to, code, st);
}

/* The file with one line for each photograph, the last. */
static ts_code tidy(cl_manifest *m, ts_status *st)
{
    lines l = {0};
    off_t size;
    if (hold(m, st) != TS_OK) return st->code;
    const int copy = open(m->path, O_RDONLY | O_CLOEXEC);
    FILE *f = copy < 0 ? NULL : fdopen(copy, "r");
    ts_code code = f ? cut(m, &size, st) : ts_fail(st, TS_IO, "%s: cannot be read: %s", m->path, strerror(errno));
    if (!code) code = look(m, f, &l, st);
    if (!code && l.count > 0) keep_last(&l);
    if (!code && l.count < l.all) code = replace(m, f, &l, st);
    if (f) fclose(f);
    else if (copy >= 0) close(copy);
    free(l.of);
    let_go(m);
    return code;
}

/* The beginning of a photograph's line, up to the key's end. */
static void put_head(FILE *f, const cl_job *job)
{
    fputs(HEAD, f);
    io_put_json(f, job->stem);
}

/* The line of a finished item, or of a photograph its beginning; NULL: no memory. */
static char *line_of(const cl_job *job, const cl_item *item, size_t *size)
{
    io_text t;
    if (io_text_begin(&t, CL_MANIFEST_NAME, NULL) != TS_OK) return NULL;
    FILE *f = t.f;
    put_head(f, job);
    if (item) {
        fputs(", \"file\": ", f);
        io_put_json(f, job->photo);
        fputs(", \"seconds\": ", f);
        io_put_json_number(f, item->was_done ? NAN : round(item->seconds * 1e4) / 1e4);
        if (item->st.code) {
            fputs(", \"error\": ", f);
            io_put_json(f, item->st.message);
            fputs("}\n", f);
        } else fprintf(f, ", %s\n", item->result);
    }
    if (io_text_end(&t, CL_MANIFEST_NAME, NULL) != TS_OK) return NULL;
    *size = t.size;
    return t.bytes;
}

ts_code cl_manifest_check(const cl_plan *plan, const char *folder, ts_status *st)
{
    char *path = NULL;
    struct stat there, photo;
    if (asprintf(&path, "%s/%s", folder, CL_MANIFEST_NAME) < 0) return ts_fail(st, TS_NOMEM, "out of memory");
    const bool exists = stat(path, &there) == 0;
    ts_code code = TS_OK;
    if (exists && !S_ISREG(there.st_mode)) code = ts_fail(st, TS_INVALID, "%s: is in the way: it is no file", path);
    for (int i = 0; i < plan->jobs && !code; i++) {
        const char *name = plan->job[i].photo;
        if (strcmp(plan->job[i].stem, CL_MANIFEST_NAME) == 0)
            code = ts_fail(st, TS_INVALID, "%s would be written to %s, which lists the results: rename it", name, path);
        else if (exists && stat(name, &photo) == 0 && photo.st_dev == there.st_dev && photo.st_ino == there.st_ino)
            code = ts_fail(st, TS_INVALID, "%s would replace the photograph %s: use another output folder", path, name);
    }
    free(path);
    return code;
}

static void release(cl_manifest **mm)
{
    cl_manifest *m = *mm;
    if (!m) return;
    if (m->fd >= 0) close(m->fd);
    free(m->path);
    free(m->photo);
    free(m);
    *mm = NULL;
}

cl_manifest *cl_manifest_open(const cl_plan *plan, const char *folder, ts_status *st)
{
    cl_manifest *m = calloc(1, sizeof *m);
    ts_code code = m ? TS_OK : ts_fail(st, TS_NOMEM, "out of memory for %s", CL_MANIFEST_NAME);
    if (m) {
        m->fd = -1;
        m->photo = calloc((size_t)plan->jobs + 1, sizeof *m->photo);
        if (!m->photo || asprintf(&m->path, "%s/%s", folder, CL_MANIFEST_NAME) < 0) {
            m->path = NULL; /* undefined after a failure */
            code = ts_fail(st, TS_NOMEM, "out of memory for %s", CL_MANIFEST_NAME);
        }
    }
    for (int i = 0; i < plan->jobs && !code; i++) {
        size_t size;
        char *head = line_of(&plan->job[i], NULL, &size);
        if (!head) code = ts_fail(st, TS_NOMEM, "out of memory for %s", CL_MANIFEST_NAME);
        else m->photo[m->photos++].key = ts_hash(head + sizeof HEAD - 1, size - (sizeof HEAD - 1), 0);
        free(head);
    }
    if (!code) {
        qsort(m->photo, (size_t)m->photos, sizeof *m->photo, by_key);
        code = tidy(m, st);
    }
    if (code) release(&m);
    return m;
}

ts_code cl_manifest_add(cl_manifest *m, const cl_item *item, ts_status *st)
{
    size_t size;
    char *line = line_of(item->job, item, &size);
    if (!line) return ts_fail(st, TS_NOMEM, "%s: out of memory", m->path);
    known *k = find(m, key_of(line, size));
    const uint64_t tail = tail_of(line, size);
    ts_code code = TS_OK;
    off_t end;
    if (!(item->was_done && k->there && k->tail == tail)) {
        code = hold(m, st);
        if (!code) code = cut(m, &end, st);
        ssize_t n = 0;
        while (!code && (n = write(m->fd, line, size)) < 0 && errno == EINTR) continue;
        if (!code && n != (ssize_t)size) {
            code = ts_fail(st, TS_IO, "%s: cannot be written: %s", m->path, n < 0 ? strerror(errno) : "no room");
            if (n > 0) (void)!ftruncate(m->fd, end);
        }
        let_go(m);
        if (!code) k->there = true, k->tail = tail;
    }
    free(line);
    return code;
}

ts_code cl_manifest_close(cl_manifest **mm, ts_status *st)
{
    cl_manifest *m = *mm;
    if (!m) return TS_OK;
    ts_code code = tidy(m, st);
    if (m->fd >= 0 && fsync(m->fd) != 0 && errno != EINVAL && errno != ENOTSUP && !code)
        code = ts_fail(st, TS_IO, "%s: cannot be written: %s", m->path, strerror(errno));
    release(mm);
    return code;
}
