#include "cli/data/new_set.h"
#include "tensor/new_file.h"
#include <dirent.h>
#include <errno.h>
#include <fcntl.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

ts_code cl_new_set_begin(cl_new_set *s, const char *folder, const char *mark, ts_status *st)
{
    struct stat info;
    *s = (cl_new_set){.mark = mark, .lock = -1, .moving = -1, .there = stat(folder, &info) == 0};
    if (snprintf(s->folder, sizeof s->folder, "%s", folder) >= (int)sizeof s->folder)
        return ts_fail(st, TS_INVALID, "%.200s...: the name is too long", folder);
    if (s->there && !S_ISDIR(info.st_mode)) return ts_fail(st, TS_IO, "%s: is in the way: it is not a folder", folder);
    if (s->there) ts_sweep(folder);
    /* inside the folder when it exists: it may lie on another file system than its parent */
    char *parent = s->there ? strdup(folder) : ts_folder_of(folder);
    const ts_code code = parent ? ts_hidden_folder(parent, &s->hidden, &s->lock, st)
                                : ts_fail(st, TS_NOMEM, "%s: out of memory", folder);
    free(parent);
    return code;
}

/* One process at a time, so that the files that stay are of one run. Without locks they come in any order. */
static ts_code remove_mark(cl_new_set *s, ts_status *st)
{
    char mark[TS_PATH_LENGTH];
    s->moving = open(s->folder, O_RDONLY | O_DIRECTORY | O_CLOEXEC);
    if (s->moving >= 0) (void)!flock(s->moving, LOCK_EX);
    if (!s->mark) return TS_OK;
    if (ts_path_in(mark, s->folder, s->mark, st) != TS_OK) return st->code;
    if (unlink(mark) != 0 && errno != ENOENT)
        return ts_fail(st, TS_IO, "%s: cannot be replaced: %s", mark, strerror(errno));
    return TS_OK;
}

static int visible(const struct dirent *entry) { return *entry->d_name != '.'; }

static ts_code move_files(const cl_new_set *s, ts_status *st)
{
    struct dirent **list;
    const int n = scandir(s->hidden, &list, visible, alphasort);
    if (n < 0) return ts_fail(st, TS_IO, "%s: cannot be read: %s", s->hidden, strerror(errno));
    ts_code code = TS_OK;
    for (int i = 0; i < n; i++) {
        if (!code && !(s->mark && strcmp(list[i]->d_name, s->mark) == 0))
            code = ts_move_file(s->hidden, s->folder, list[i]->d_name, st);
        free(list[i]);
    }
    free(list);
    if (!code) ts_sync_folder(s->folder);
    return code || !s->mark ? code : ts_move_file(s->hidden, s->folder, s->mark, st);
}

static ts_code publish(cl_new_set *s, ts_status *st)
{
    if (!s->there && rename(s->hidden, s->folder) == 0) {
        close(s->lock);
        free(s->hidden);
        s->hidden = NULL;
        return TS_OK;
    }
    if (!s->there && errno != ENOTEMPTY && errno != EEXIST) /* else another process has made it meanwhile */
        return ts_fail(st, TS_IO, "%s: cannot be made: %s", s->folder, strerror(errno));
    const ts_code code = s->there ? TS_OK : remove_mark(s, st);
    return code ? code : move_files(s, st);
}

ts_code cl_new_sets_end(cl_new_set *s, int count, ts_code code, ts_status *st)
{
    for (int i = 0; i < count && !code; i++)
        if (s[i].there) code = remove_mark(&s[i], st);
    for (int i = 0; i < count && !code; i++) code = publish(&s[i], st);
    for (int i = 0; i < count; i++) {
        if (!code) ts_sync_folder(s[i].folder);
        if (s[i].hidden) ts_hidden_folder_remove(s[i].hidden, &s[i].lock);
        if (s[i].moving >= 0) close(s[i].moving);
        free(s[i].hidden);
        s[i].hidden = NULL;
    }
    return code;
}
