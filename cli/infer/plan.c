#include "cli/infer/plan.h"
#include "infer/order.h"
#include "tensor/hash.h"
#include <stdbool.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>

static bool no_name(const char *s) { return !*s || strcmp(s, ".") == 0 || strcmp(s, "..") == 0; }

/* The name of a folder, of one that is given as "." or the like the one it has; NULL: path is none. The caller frees
 * it. */
static char *folder_name(const char *path)
{
    struct stat info;
    if (stat(path, &info) != 0 || !S_ISDIR(info.st_mode)) return NULL;
    size_t end = strlen(path);
    while (end > 0 && path[end - 1] == '/') end--;
    size_t begin = end;
    while (begin > 0 && path[begin - 1] != '/') begin--;
    char *name = strndup(path + begin, end - begin);
    if (!name || !no_name(name)) return name;
    char *whole = realpath(path, NULL);
    free(name);
    name = whole ? strdup(strrchr(whole, '/') + 1) : NULL;
    free(whole);
    return name;
}

/* Of a capture.ini the name of the folder that it lies in: all have this name. NULL: path is none, or that folder has
 * no name. The caller frees it. */
static char *capture_name(const char *path)
{
    const char *slash = strrchr(path, '/'), *name = slash ? slash + 1 : path;
    if (strcmp(name, "capture.ini") != 0) return NULL;
    char *folder = slash ? strndup(path, (size_t)(name - path)) : strdup("."),
         *found = folder ? folder_name(folder) : NULL;
    free(folder);
    if (found && no_name(found)) {
        free(found);
        found = NULL;
    }
    return found;
}

/* A copy of the stem, or NULL. *bad: the path has no usable name. */
static char *stem_of(const char *path, bool *bad)
{
    char *folder = folder_name(path);
    if (!folder) folder = capture_name(path);
    if (folder) {
        *bad = no_name(folder);
        return folder;
    }
    const char *slash = strrchr(path, '/'), *name = slash ? slash + 1 : path;
    char *stem = strdup(name);
    *bad = no_name(name);
    if (!stem || *bad) return stem;
    char *dot = strrchr(stem, '.');
    if (dot) *dot = 0;
    if (no_name(stem)) strcpy(stem, name);
    return stem;
}

static int by_stem(const void *a, const void *b)
{
    const cl_job *x = *(const cl_job *const *)a, *y = *(const cl_job *const *)b;
    const int order = strcmp(x->stem, y->stem);
    return order ? order : (x > y) - (x < y);
}

static bool same_file(const char *a, const char *b)
{
    struct stat x, y;
    return strcmp(a, b) == 0 || (stat(a, &x) == 0 && stat(b, &y) == 0 && x.st_dev == y.st_dev && x.st_ino == y.st_ino);
}

int cl_plan_distinct(char **photo, int count)
{
    int kept = 0;
    for (int i = 0; i < count; i++) {
        char *own = photo[i];
        bool again = false;
        for (int k = 0; k < kept && !again; k++) again = same_file(photo[k], own);
        if (again) continue;
        photo[i] = photo[kept];
        photo[kept++] = own;
    }
    return kept;
}

static void free_job(cl_job *job)
{
    free(job->stem);
    free(job->folder);
    *job = (cl_job){0};
}

/* Takes out the photographs that are given a second time. Two of one stem are refused. */
static ts_code check_stems(cl_plan *plan, ts_status *st)
{
    cl_job **sorted = malloc((size_t)plan->jobs * sizeof *sorted);
    if (!sorted) return ts_fail(st, TS_NOMEM, "out of memory for %d photographs", plan->jobs);
    for (int i = 0; i < plan->jobs; i++) sorted[i] = &plan->job[i];
    qsort(sorted, (size_t)plan->jobs, sizeof *sorted, by_stem);
    const cl_job *first = NULL, *second = NULL;
    int pairs = 0, kept = 0;
    for (int i = 1, k = 0; i < plan->jobs; i++) { /* k: the last that stays */
        if (strcmp(sorted[k]->stem, sorted[i]->stem) != 0) k = i;
        else if (same_file(sorted[k]->photo, sorted[i]->photo)) free_job(sorted[i]);
        else {
            if (!pairs++) first = sorted[k], second = sorted[i];
            k = i;
        }
    }
    ts_code code = TS_OK;
    if (pairs)
        code = ts_fail(st, TS_INVALID,
                       "%s and %s would both be written to %s (%d such pair%s in all): rename one, list those that are "
                       "wanted in a file for @LIST, or use calls with different folders",
                       first->photo, second->photo, second->folder, pairs, pairs > 1 ? "s" : "");
    free(sorted);
    for (int i = 0; i < plan->jobs; i++)
        if (plan->job[i].stem) plan->job[kept++] = plan->job[i];
    plan->jobs = kept;
    return code;
}

/* A file's identity, so that links and relative names cannot hide that an output is an input. */
typedef struct identity {
    dev_t device;
    ino_t inode;
    const char *file;
} identity;

static int by_identity(const void *a, const void *b)
{
    const identity *x = a, *y = b;
    if (x->device != y->device) return x->device < y->device ? -1 : 1;
    return (x->inode > y->inode) - (x->inode < y->inode);
}

ts_code cl_plan_check(const cl_plan *plan, const char *what, const char *const *file, int files, ts_status *st)
{
    identity *id = malloc((size_t)files * sizeof *id + 1);
    if (!id) return ts_fail(st, TS_NOMEM, "out of memory for %d photographs", files);
    int known = 0;
    for (int i = 0; i < files; i++) {
        struct stat info;
        if (stat(file[i], &info) == 0) id[known++] = (identity){info.st_dev, info.st_ino, file[i]};
    }
    qsort(id, (size_t)known, sizeof *id, by_identity);
    ts_code code = TS_OK;
    for (int i = 0; i < plan->jobs && !code; i++) {
        for (int k = -1; k < LGD_FILES && !code;
             k++) { /* -1: the folder itself, which a photograph without extension may be */
            char path[4096];
            if (snprintf(path, sizeof path, "%s%s%s", plan->job[i].folder, k < 0 ? "" : "/",
                         k < 0 ? "" : lgd_files[k]) >= (int)sizeof path)
                code = ts_fail(st, TS_INVALID, "%s: the name of the output folder is too long", plan->job[i].photo);
            struct stat info;
            if (!code && stat(path, &info) != 0) {
                if (k < 0) break; /* without a folder there is nothing in it */
                continue;
            }
            if (code) continue;
            const identity key = {info.st_dev, info.st_ino, NULL},
                           *hit = bsearch(&key, id, (size_t)known, sizeof *id, by_identity);
            if (hit && !S_ISDIR(info.st_mode))
                code = ts_fail(st, TS_INVALID, "%s would replace the %s %s: use another output folder", path, what,
                               hit->file);
        }
    }
    free(id);
    return code;
}

ts_code cl_plan_make(char *const *photos, int count, const char *out, cl_plan *plan, ts_status *st)
{
    ts_code code = TS_OK;
    *plan = (cl_plan){.job = calloc((size_t)count, sizeof(cl_job)), .jobs = count};
    if (!plan->job) code = ts_fail(st, TS_NOMEM, "out of memory for %d photographs", count);
    for (int i = 0; i < count && !code; i++) {
        cl_job *job = &plan->job[i];
        bool bad;
        job->photo = photos[i];
        job->stem = stem_of(photos[i], &bad);
        if (bad) code = ts_fail(st, TS_INVALID, "'%s' is not the name of a photograph's file", photos[i]);
        else if (!job->stem || asprintf(&job->folder, "%s/%s", out, job->stem) < 0) {
            job->folder = NULL; /* undefined after a failure */
            code = ts_fail(st, TS_NOMEM, "out of memory for %d photographs", count);
        }
    }
    if (!code) code = check_stems(plan, st);
    if (!code) code = cl_plan_check(plan, "photograph", (const char *const *)photos, count, st);
    if (code) cl_plan_free(plan);
    return code;
}

void cl_plan_keep(cl_plan *plan, int shard, int shards)
{
    int kept = 0;
    for (int i = 0; i < plan->jobs; i++) {
        cl_job *job = &plan->job[i];
        if (ts_hash(job->stem, strlen(job->stem), 0) % (uint64_t)shards == (uint64_t)(shard - 1))
            plan->job[kept++] = *job;
        else free_job(job);
    }
    plan->jobs = kept;
}

void cl_plan_free(cl_plan *plan)
{
    for (int i = 0; plan->job && i < plan->jobs; i++) free_job(&plan->job[i]);
    free(plan->job);
    *plan = (cl_plan){0};
}
