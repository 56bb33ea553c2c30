#include "data/collection.h"
#include "data/height.h"
#include <dirent.h>
#include <errno.h>
#include <limits.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>

enum { PIXELS = IO_COLLECTION_SIDE * IO_COLLECTION_SIDE };

typedef struct planes {
    float height[PIXELS];
    uint16_t value[IO_COLLECTED][PIXELS];
} planes;

struct io_collection {
    int count;
    planes *set[];
};

static int visible(const struct dirent *entry) { return *entry->d_name != '.'; }

static uint16_t fixed(float unit) { return (uint16_t)(65535 * unit + 0.5f); }

static ts_code read_set(const char *path, int threads, planes *set, ts_status *st)
{
    io_material m;
    ts_code code = io_read_map_folder(path, NULL, IO_COLLECTION_SIDE, &m, st);
    if (code == TS_OK) code = io_height(&m, true, set->height, threads, st);
    for (int i = 0; i < PIXELS && code == TS_OK; i++) {
        const io_texel t = io_texel_get(m.maps + (size_t)i * MAP_CHANNELS);
        for (int k = 0; k < 3; k++) {
            set->value[k][i] = fixed(t.diffuse[k]);
            set->value[3 + k][i] = fixed(t.specular[k]);
        }
        set->value[6][i] = fixed(t.roughness);
    }
    io_material_free(&m);
    return code;
}

static ts_code read_sets(const char *path, struct dirent **list, int n, int threads, io_collection *c, ts_status *st)
{
    for (int i = 0; i < n; i++) {
        char folder[PATH_MAX];
        struct stat about;
        if (snprintf(folder, sizeof folder, "%s/%s", path, list[i]->d_name) >= (int)sizeof folder)
            return ts_fail(st, TS_INVALID, "%s: name too long", path);
        if (stat(folder, &about) || !S_ISDIR(about.st_mode)) continue;
        planes *set = malloc(sizeof *set);
        if (!set) return ts_fail(st, TS_NOMEM, "%s: no memory for set %d of %d (put fewer there)", path, i + 1, n);
        c->set[c->count++] = set;
        if (read_set(folder, threads, set, st) != TS_OK) return st->code;
    }
    return c->count ? TS_OK : ts_fail(st, TS_INVALID, "%s: no folders in it: every map set needs one of its own", path);
}

io_collection *io_collection_read(const char *path, int threads, ts_status *st)
{
    struct dirent **list;
    const int n = scandir(path, &list, visible, alphasort);
    if (n < 0) {
        ts_fail(st, TS_IO, "%s: %s", path, strerror(errno));
        return NULL;
    }
    io_collection *c = calloc(1, sizeof *c + (size_t)n * sizeof *c->set);
    if (!c) ts_fail(st, TS_NOMEM, "%s: out of memory", path);
    else if (read_sets(path, list, n, threads, c, st) != TS_OK) io_collection_free(&c);
    for (int i = 0; i < n; i++) free(list[i]);
    free(list);
    return c;
}

int io_collection_count(const io_collection *c) { return c->count; }

io_collected io_collection_get(const io_collection *c, int number)
{
    const planes *p = c->set[number];
    io_collected set = {.height = p->height};
    for (int k = 0; k < IO_COLLECTED; k++) set.value[k] = p->value[k];
    return set;
}

void io_collection_free(io_collection **collection)
{
    io_collection *c = *collection;
    if (!c) return;
    for (int i = 0; i < c->count; i++) free(c->set[i]);
    free(c);
    *collection = NULL;
}
