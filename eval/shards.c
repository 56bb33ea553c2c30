#include "eval/shards.h"
#include "data/text.h"
#include "tensor/cpu.h"
#include "tensor/hash.h"
#include "tensor/new_file.h"
#include <errno.h>
#include <fcntl.h>
#include <limits.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/file.h>
#include <unistd.h>

enum { PATH_LENGTH = 4096 };
#define MAGIC "lgd-eval part 1\n"
#define PNG_LIMIT ((uint64_t)1 << 28)

/* What a part begins with. Then uint64_t bytes[methods], and each result: entry, rows, seconds, peaks, pictures. */
typedef struct head {
    char magic[16];
    uint64_t print;
    int64_t shard, shards, methods, columns, results, failures;
} head;

typedef struct entry {
    int64_t number, method, set, kind, columns, rows, inputs;
    char material[128];
} entry;

/* Of a file that cannot be read, which may be one that a method does without, 0. */
static void put_hash(FILE *f, const char *path)
{
    uint64_t hash = 0;
    if (!path || !*path || ts_hash_file(path, &hash, NULL) != TS_OK) hash = 0;
    fprintf(f, "%016llx ", (unsigned long long)hash);
}

/* Of those that are not the program's model. */
static void put_weights(FILE *f, const ev_estimator *e, const char *model)
{
    const ev_setting *s = e->method->settings;
    for (int i = 0; s[i].key; i++)
        if (s[i].type == EV_WEIGHTS && strcmp(e->value[i], model) != 0) put_hash(f, e->value[i]);
}

uint64_t ev_shards_print(const ev_command *c, const ev_run *r, const char *model)
{
    io_text t;
    uint64_t print;
    if (io_text_begin(&t, "", NULL) != TS_OK) return 0;
    FILE *f = t.f;
    put_hash(f, model);
    fprintf(f, LGD_VERSION " %s %d %d %lld %d %.17g %.17g %.17g %.17g %.17g %.17g", ts_isa_name(ts_isa_now()), c->size,
            c->iterations, (long long)c->seed, c->repeat, c->noise, c->exposure, c->fov, c->tilt, c->light[0],
            c->light[1]);
    fprintf(f, " %d%d%d%d%d%d%d%d %s\n%s\n%s\n%s\n", c->light_known, c->light_unknown, c->photographed, c->fast,
            c->exact, c->tune, c->iterations_figure, c->methods_figure, c->camera_spec ? c->camera_spec : "",
            c->peer_maps ? c->peer_maps : "", c->lpips[0] ? c->lpips[0] : "", c->lpips[1] ? c->lpips[1] : "");
    for (int m = 0; m < r->methods; m++) {
        fprintf(f, "%s\n", r->method[m].label);
        put_weights(f, &r->method[m], model);
    }
    for (int k = 0; k < 2; k++) put_hash(f, c->lpips[k]);
    for (int m = 0; m < c->methods; m++) fprintf(f, "%s\n", c->method[m]);
    for (int s = 0; s < r->sets; s++) {
        const ev_set *set = &r->set[s];
        fprintf(f, "%s %d %d%d%d %d%d%d\n", set->spec, set->count, set->option.normal, set->option.workflow,
                set->option.colour, set->convention.normal, set->convention.workflow, set->convention.colour);
        for (int i = 0; i < set->count; i++) fprintf(f, "%llx ", (unsigned long long)ev_set_identity(set, i));
    }
    if (io_text_end(&t, "", NULL) != TS_OK) return 0;
    print = ts_hash(t.bytes, t.size, 0);
    free(t.bytes);
    return print;
}

static ts_code name_of(char path[PATH_LENGTH], const char *folder, int shard, int shards, ts_status *st)
{
    if (snprintf(path, PATH_LENGTH, "%s/part-%d-of-%d", folder, shard, shards) >= PATH_LENGTH)
        return ts_fail(st, TS_INVALID, "%s: the name is too long", folder);
    return TS_OK;
}

static void put_result(ts_new_file *f, const ev_report *r, const ev_result *from)
{
    entry e = {from->number,        from->method,     from->set,          (int64_t)from->sheet.kind,
               from->sheet.columns, from->sheet.rows, from->sheet.inputs, ""};
    snprintf(e.material, sizeof e.material, "%s", from->material);
    ts_new_file_put(f, &e, sizeof e);
    ts_new_file_put(f, from->row, (size_t)r->columns * sizeof *from->row);
    ts_new_file_put(f, from->seconds, (size_t)r->columns * sizeof *from->seconds);
    ts_new_file_put(f, from->peak, (size_t)r->methods * sizeof *from->peak);
    for (int m = 0; m < r->methods; m++) {
        const uint64_t size = from->png[m] ? from->png_size[m] : 0;
        ts_new_file_put(f, &size, sizeof size);
        ts_new_file_put(f, from->png[m], size);
    }
}

ts_code ev_shard_write(const ev_run *r, uint64_t print, const char *folder, ts_status *st)
{
    char path[PATH_LENGTH];
    ts_new_file f;
    const ev_report *report = &r->report;
    head h = {MAGIC, print, r->shard, r->shards, r->methods, report->columns, report->results, r->failures};
    if (name_of(path, folder, r->shard, r->shards, st) != TS_OK || ts_new_file_begin(&f, path, st) != TS_OK)
        return st->code;
    ts_new_file_put(&f, &h, sizeof h);
    for (int m = 0; m < r->methods; m++) {
        const uint64_t bytes = r->subject[m].bytes;
        ts_new_file_put(&f, &bytes, sizeof bytes);
    }
    for (int i = 0; i < report->results; i++) put_result(&f, report, &report->result[i]);
    return ts_new_file_end(&f, TS_OK, st);
}

int ev_shards_lock(const char *folder)
{
    const int fd = open(folder, O_RDONLY | O_DIRECTORY | O_CLOEXEC);
    while (fd >= 0 && flock(fd, LOCK_EX) != 0 && errno == EINTR) continue;
    return fd;
}

static bool get(FILE *f, void *to, size_t size) { return size == 0 || fread(to, size, 1, f) == 1; }

/* The part's file if it is of this evaluation, or NULL; *strange: there is another in its place. */
static FILE *open_part(const ev_run *r, uint64_t print, const char *folder, int shard, head *h, bool *strange)
{
    char path[PATH_LENGTH];
    FILE *f = name_of(path, folder, shard, r->shards, NULL) == TS_OK ? fopen(path, "re") : NULL;
    if (f &&
        !(get(f, h, sizeof *h) && memcmp(h->magic, MAGIC, sizeof h->magic) == 0 && h->print == print &&
          h->shard == shard && h->shards == r->shards && h->methods == r->methods && h->columns == r->report.columns &&
          h->results >= 0 && h->results <= INT_MAX)) {
        fclose(f);
        *strange = true;
        f = NULL;
    }
    return f;
}

static bool get_pictures(FILE *f, int methods, ev_result *to)
{
    for (int m = 0; m < methods; m++) {
        uint64_t size;
        if (!get(f, &size, sizeof size) || size > PNG_LIMIT) return false;
        if (size == 0) continue;
        if (!(to->png[m] = malloc(size)) || !get(f, to->png[m], size)) return false;
        to->png_size[m] = size;
    }
    return true;
}

static bool get_result(FILE *f, ev_run *r, ev_report *all, ts_status *st)
{
    entry e;
    if (!get(f, &e, sizeof e) || e.set < 0 || e.set >= r->sets || !memchr(e.material, 0, sizeof e.material) ||
        e.kind < EV_SHEET_MAPS || e.kind > EV_SHEET_ALONE)
        return false;
    const int at = ev_report_add(all, (int)e.set, e.material, st);
    if (at < 0) return false;
    ev_result *to = &all->result[at];
    to->number = e.number;
    to->method = (int)e.method;
    to->sheet = (ev_sheet_shape){(ev_sheet_kind)e.kind, (int)e.columns, (int)e.rows, (int)e.inputs};
    return get(f, to->row, (size_t)all->columns * sizeof *to->row) &&
        get(f, to->seconds, (size_t)all->columns * sizeof *to->seconds) &&
        get(f, to->peak, (size_t)all->methods * sizeof *to->peak) && get_pictures(f, all->methods, to);
}

static ts_code get_part(FILE *f, const head *h, ev_run *r, ev_report *all, size_t *bytes, ts_status *st)
{
    bool fine = true;
    for (int m = 0; m < r->methods && fine; m++) {
        uint64_t peak;
        fine = get(f, &peak, sizeof peak);
        if (fine && peak > bytes[m]) bytes[m] = (size_t)peak;
    }
    for (int64_t i = 0; i < h->results && fine; i++) fine = get_result(f, r, all, st);
    fine = fine && fgetc(f) == EOF && !ferror(f);
    return fine || st->code ? st->code : TS_FORMAT;
}

/* As one process finds them: the first method's materials, then those where that failed and the next did not. */
static int by_order(const void *a, const void *b)
{
    const ev_result *x = a, *y = b;
    if (x->method != y->method) return x->method < y->method ? -1 : 1;
    return (x->number > y->number) - (x->number < y->number);
}

/* The report keeps as many pictures as one process makes. */
static void drop_pictures(ev_report *all)
{
    int left = EV_PICTURES;
    for (int m = 0; m < all->methods; m++)
        for (int i = 0; i < all->results; i++) {
            ev_result *at = &all->result[i];
            if (!at->png[m] || left-- > 0) continue;
            free(at->png[m]);
            at->png[m] = NULL;
            at->png_size[m] = 0;
        }
}

ts_code ev_shards_merge(ev_run *r, uint64_t print, const char *folder, ev_parts *parts, ts_status *st)
{
    head h;
    *parts = (ev_parts){0};
    for (int shard = 1; shard <= r->shards; shard++) {
        bool strange = false;
        FILE *f = open_part(r, print, folder, shard, &h, &strange);
        if (f) fclose(f);
        if (f && shard == r->shard) parts->mine = true;
        if (!f && parts->missing++ == 0) parts->first = shard;
        parts->strange += strange;
    }
    if (parts->missing) return TS_OK;
    ev_report all = r->report;
    all.result = NULL;
    all.results = all.capacity = 0;
    size_t *bytes = calloc((size_t)r->methods, sizeof *bytes);
    int64_t failures = 0;
    ts_code code = bytes ? TS_OK : ts_fail(st, TS_NOMEM, "out of memory");
    for (int shard = 1; shard <= r->shards && !code; shard++) {
        FILE *f = open_part(r, print, folder, shard, &h, &(bool){false});
        code = f ? get_part(f, &h, r, &all, bytes, st) : TS_FORMAT;
        if (f) fclose(f);
        failures += code ? 0 : h.failures;
        if (code == TS_FORMAT)
            ts_fail(st, TS_FORMAT, "%s/part-%d-of-%d: is damaged: do that part again", folder, shard, r->shards);
    }
    if (code) ev_report_free(&all);
    else {
        if (all.results) qsort(all.result, (size_t)all.results, sizeof *all.result, by_order);
        drop_pictures(&all);
        ev_report_free(&r->report);
        r->report = all;
        r->failures = (int)failures;
        for (int m = 0; m < r->methods; m++) r->subject[m].bytes = bytes[m];
    }
    free(bytes);
    return code;
}

void ev_shards_remove(const ev_run *r, const char *folder)
{
    char path[PATH_LENGTH];
    for (int shard = 1; shard <= r->shards; shard++)
        if (name_of(path, folder, shard, r->shards, NULL) == TS_OK) unlink(path);
}
