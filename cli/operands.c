#include "cli/operands.h"
#include "cli/cli.h"
#include "data/name.h"
#include <dirent.h>
#include <errno.h>
#include <fcntl.h>
#include <stdbool.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

#define LIST_LIMIT ((size_t)1 << 26) /* bytes of a list: a larger file is none */

static ts_code add(cl_operands *all, const char *name, ts_status *st)
{
    if (all->photos == all->capacity) {
        const int capacity = all->capacity ? 2 * all->capacity : 64;
        char **more = realloc(all->photo, (size_t)capacity * sizeof *more);
        if (!more) return ts_fail(st, TS_NOMEM, "out of memory for %d photographs", capacity);
        all->photo = more;
        all->capacity = capacity;
    }
    if (!(all->photo[all->photos] = strdup(name)))
        return ts_fail(st, TS_NOMEM, "out of memory for %d photographs", all->photos);
    all->photos++;
    return TS_OK;
}

static int by_name(const void *a, const void *b) { return strcmp(*(char *const *)a, *(char *const *)b); }

static ts_code add_folder(cl_operands *all, const char *folder, ts_status *st)
{
    const int first = all->photos;
    const size_t length = strlen(folder);
    DIR *d = opendir(folder);
    if (!d) return ts_fail(st, TS_IO, "%s: cannot be read: %s", folder, strerror(errno));
    ts_code code = TS_OK;
    while (!code) {
        char *path = NULL;
        errno = 0;
        const struct dirent *e = readdir(d);
        if (!e && errno) code = ts_fail(st, TS_IO, "%s: cannot be read to its end: %s", folder, strerror(errno));
        if (!e) break;
        struct stat info;
        if (!io_is_image_name(e->d_name)) continue;
        if (asprintf(&path, "%s%s%s", folder, length && folder[length - 1] == '/' ? "" : "/", e->d_name) < 0) {
            path = NULL; /* undefined after a failure */
            code = ts_fail(st, TS_NOMEM, "%s: out of memory", folder);
        } else if (stat(path, &info) != 0 || S_ISREG(info.st_mode)) code = add(all, path, st); /* readers say why not */
        free(path);
    }
    closedir(d);
    if (!code && all->photos == first)
        code = ts_fail(st, TS_IO, "%s: there is no photograph in this folder: name one with JPEG, PNG or HEIC files",
                       folder);
    if (all->photos > first) qsort(all->photo + first, (size_t)(all->photos - first), sizeof *all->photo, by_name);
    return code;
}

static ts_code add_operand(cl_operands *all, const char *name, ts_status *st)
{
    struct stat info;
    const size_t length = strlen(name);
    const bool there = stat(name, &info) == 0;
    if (there && S_ISDIR(info.st_mode)) return add_folder(all, name, st);
    if (!there && length && name[length - 1] == '/') return ts_fail(st, TS_IO, "%s: %s", name, strerror(errno));
    return add(all, name, st);
}

/* A failure of one is reported; what is returned ends the work. */
static ts_code take(cl_operands *all, const char *name, void (*failed)(const char *message), ts_status *st)
{
    ts_status own = {0};
    if (add_operand(all, name, &own) == TS_NOMEM) return ts_fail(st, TS_NOMEM, "%s", own.message);
    if (own.code) {
        failed(own.message);
        all->failed++;
    }
    return TS_OK;
}

/* The text of a file or a pipe, with a zero byte after its end, which the caller frees. */
static ts_code read_list(const char *list, char **text, size_t *size, ts_status *st)
{
    const bool given = strcmp(list, "-") == 0;
    const char *what = given ? "standard input" : list;
    const int fd = given ? STDIN_FILENO : open(list, O_RDONLY | O_CLOEXEC);
    size_t room = 0;
    ssize_t n = 1;
    ts_code code = TS_OK;
    *size = 0;
    if (fd < 0 && errno == EINTR && cl_interrupted())
        code = ts_fail(st, TS_INTERRUPTED, "interrupted while %s was opened", what);
    else if (fd < 0) code = ts_fail(st, TS_IO, "%s: %s", list, strerror(errno));
    while (!code && n != 0) {
        if (*size + 1 >= room) {
            char *more = realloc(*text, room = room ? 2 * room : 1 << 16);
            if (!more) code = ts_fail(st, TS_NOMEM, "%s: out of memory", list);
            else *text = more;
        }
        if (code) break;
        n = read(fd, *text + *size, room - 1 - *size);
        if (n > 0) *size += (size_t)n;
        else if (n < 0 && errno != EINTR) code = ts_fail(st, TS_IO, "%s: cannot be read: %s", what, strerror(errno));
        else if (n < 0 && cl_interrupted()) code = ts_fail(st, TS_INTERRUPTED, "interrupted while %s was read", what);
        if (*size > LIST_LIMIT) code = ts_fail(st, TS_UNSUPPORTED, "%s: longer than %zu bytes", what, LIST_LIMIT);
    }
    if (fd >= 0 && !given) close(fd);
    if (!code) (*text)[*size] = 0;
    return code;
}

/* name: of the list, behind an @. A byte-order mark, carriage returns and blank lines are passed over. */
static ts_code take_list(cl_operands *all, const char *name, void (*failed)(const char *message), ts_status *st)
{
    char *text = NULL;
    const char *list = name + 1;
    size_t size = 0;
    int names = 0;
    ts_status own = {0};
    ts_code code = TS_OK;
    if (read_list(list, &text, &size, &own) == TS_OK) {
        char *line = text + (size >= 3 && memcmp(text, "\xef\xbb\xbf", 3) == 0 ? 3 : 0);
        for (char *next; line && !code; line = next) {
            if ((next = strchr(line, '\n'))) *next++ = 0;
            const size_t length = strlen(line);
            if (length && line[length - 1] == '\r') line[length - 1] = 0;
            if (*line) names++, code = take(all, line, failed, st);
        }
        if (!names && !code) ts_fail(&own, TS_IO, "%s: the list has no names: write one photograph a line", name);
    } else if (own.code == TS_INTERRUPTED) code = ts_fail(st, own.code, "%s", own.message);
    else if (access(list, F_OK) != 0 && access(name, F_OK) == 0)
        ts_fail(&own, TS_IO, "%s: there is no such list: write ./%s for the photograph", list, name);
    if (own.code && !code) {
        failed(own.message);
        all->failed++;
    }
    free(text);
    return code;
}

ts_code cl_operands_expand(char *const *operand, int count, void (*failed)(const char *message), cl_operands *all,
                           ts_status *st)
{
    ts_code code = TS_OK;
    *all = (cl_operands){0};
    for (int i = 0; i < count && !code; i++)
        code = operand[i][0] == '@' && operand[i][1] ? take_list(all, operand[i], failed, st)
                                                     : take(all, operand[i], failed, st);
    if (code) cl_operands_free(all);
    return code;
}

void cl_operands_free(cl_operands *all)
{
    for (int i = 0; i < all->photos; i++) free(all->photo[i]);
    free(all->photo);
    *all = (cl_operands){0};
}
