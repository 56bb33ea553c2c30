#include "data/collection.h"
#include "data/height.h"
#include "tensor/hash.h"
#include <dirent.h>
#include <errno.h>
#include <limits.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>

enum { PIXELS = IO_COLLECTION_SIDE * IO_COLLECTION_SIDE };

struct io_collection {
    int count;
    uint64_t hash;
    io_collected *set[]; /* [PIXELS] each */
};

static int visible(const struct dirent *entry) { return *entry->d_name != '.'; }

static uint16_t fixed(float unit) { return (uint16_t)(65535 * unit + 0.5f); }

static ts_code read_set(const char *path, int threads, float *height, io_collected *set, ts_status *st)
{
    io_material m;
    ts_code code = io_read_map_folder(path, NULL, IO_COLLECTION_SIDE, &m, st);
    if (code == TS_OK) code = io_height(&m, true, height, threads, st);
    for (int i = 0; i < PIXELS && code == TS_OK; i++) {
        const io_texel t = io_texel_get(m.maps + (size_t)i * MAP_CHANNELS);
        set[i].height = height[i];
        for (int k = 0; k < 3; k++) {
            set[i].value[k] = fixed(t.diffuse[k]);
            set[i].value[3 + k] = fixed(t.specular[k]);
        }
        set[i].value[6] = fixed(t.roughness);
    }
    io_material_free(&m);
    return code;
}

typedef struct asked {
    bool (*stop)(void *user);
    void *user;
} asked;

/* Takes the names and bytes of a set's files into the hash: what is computed of them depends on the CPU. */
static ts_code add_hash(const char *folder, uint64_t *hash, ts_status *st)
{
    struct dirent **list;
    const int n = scandir(folder, &list, visible, alphasort);
    ts_code code = n < 0 ? ts_fail(st, TS_IO, "%s: %s", folder, strerror(errno)) : TS_OK;
    for (int i = 0; i < n; i++) {
        char path[PATH_MAX];
        struct stat about;
        uint64_t bytes = 0;
        if (!code && snprintf(path, sizeof path, "%s/%s", folder, list[i]->d_name) >= (int)sizeof path)
            code = ts_fail(st, TS_INVALID, "%s: name too long", folder);
        if (!code && stat(path, &about) == 0 && S_ISREG(about.st_mode)) {
            code = ts_hash_file(path, &bytes, st);
            *hash = ts_hash(list[i]->d_name, strlen(list[i]->d_name), ts_hash(&bytes, sizeof bytes, *hash));
        }
        free(list[i]);
    }
    if (n >= 0) free(list);
    return code;
}

static ts_code read_sets(const char *path, struct dirent **list, int n, int threads, asked a, float *height,
                         io_collection *c, ts_status *st)
{
    for (int i = 0; i < n; i++) {
        if (a.stop && a.stop(a.user)) return ts_fail(st, TS_INTERRUPTED, "%s: interrupted while it was read", path);
        char folder[PATH_MAX];
        struct stat about;
        if (snprintf(folder, sizeof folder, "%s/%s", path, list[i]->d_name) >= (int)sizeof folder)
            return ts_fail(st, TS_INVALID, "%s: name too long", path);
        if (stat(folder, &about) || !S_ISDIR(about.st_mode)) continue;
        io_collected *set = malloc(PIXELS * sizeof *set);
        if (!set) return ts_fail(st, TS_NOMEM, "%s: no memory for set %d of %d (put fewer there)", path, i + 1, n);
        c->set[c->count++] = set;
        if (read_set(folder, threads, height, set, st) != TS_OK || add_hash(folder, &c->hash, st) != TS_OK)
            return st->code;
    }
    return c->count ? TS_OK : ts_fail(st, TS_INVALID, "%s: no folders in it: every map set needs one of its own", path);
}

io_collection *io_collection_read(const char *path, int threads, bool (*stop)(void *user), void *user, ts_status *st)
{
    struct dirent **list;
    const int n = scandir(path, &list, visible, alphasort);
    if (n < 0) {
        ts_fail(st, TS_IO, "%s: %s", path, strerror(errno));
        return NULL;
    }
    io_collection *c = calloc(1, sizeof *c + (size_t)n * sizeof *c->set);
    float *height = malloc(PIXELS * sizeof *height); /* of one set */
    const bool room = c && height;
    if (!room) ts_fail(st, TS_NOMEM, "%s: out of memory", path);
    if (!room || read_sets(path, list, n, threads, (asked){stop, user}, height, c, st) != TS_OK) io_collection_free(&c);
    free(height);
    for (int i = 0; i < n; i++) free(list[i]);
    free(list);
    return c;
}

int io_collection_count(const io_collection *c) { return c->count; }

uint64_t io_collection_hash(const io_collection *c) { return c->hash; }

const io_collected *io_collection_get(const io_collection *c, int number) { return c->set[number]; }

void io_collection_free(io_collection **collection)
{
    io_collection *c = *collection;
    if (!c) return;
    for (int i = 0; i < c->count; i++) free(c->set[i]);
    free(c);
    *collection = NULL;
}
