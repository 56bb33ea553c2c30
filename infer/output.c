#include "infer/output.h"
#include "data/file.h"
#include "data/seamless.h"
#include "infer/derived.h"
#include "infer/export.h"
#include "infer/meta.h"
#include "infer/page.h"
#include "infer/preview.h"
#include "tensor/hash.h"
#include "tensor/maps.h"
#include "tensor/new_file.h"
#include "tensor/team.h"
#include <errno.h>
#include <fcntl.h>
#include <inttypes.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

ts_code lgd_output_check(const char *folder, ts_status *st)
{
    char *hidden;
    int lock;
    const ts_code code = ts_hidden_folder(folder, &hidden, &lock, st);
    if (code) return code;
    ts_hidden_folder_remove(hidden, &lock);
    free(hidden);
    return TS_OK;
}

/* What is made in one go; bits of which. Slow ones first, so that two threads end together. */
static const unsigned portions[] = {LGD_OUT_EXR,      LGD_OUT_PAGE,   LGD_DERIVED,       LGD_OUT_PREVIEW,
                                    LGD_OUT_NORMAL,   LGD_OUT_RENDER, LGD_OUT_ROUGHNESS, LGD_OUT_DIFFUSE,
                                    LGD_OUT_SPECULAR, LGD_OUT_GLTF,   LGD_OUT_MATERIALX};
enum { PORTIONS = sizeof portions / sizeof *portions };

/* The bits of data/material.h. */
static unsigned map_bits(unsigned which)
{
    static const struct {
        unsigned output, maps;
    } same[] = {{LGD_OUT_DIFFUSE, IO_MAPS_DIFFUSE},
                {LGD_OUT_SPECULAR, IO_MAPS_SPECULAR},
                {LGD_OUT_ROUGHNESS, IO_MAPS_ROUGHNESS},
                {LGD_OUT_NORMAL, IO_MAPS_NORMAL},
                {LGD_OUT_EXR, IO_MAPS_EXR}};
    unsigned maps = 0;
    for (size_t i = 0; i < sizeof same / sizeof *same; i++)
        if (which & same[i].output) maps |= same[i].maps;
    return maps;
}

/* What is written, of a photograph. */
typedef struct task {
    const char *folder, *stem;
    const io_material *m, *estimate;
    const lgd_photo *photo;
    const lgd_order *order;
    lgd_gltf gltf;
    const char *mark; /* a line of meta.txt */
} task;

static ts_code write_portion(const task *t, unsigned which, lgd_derived *derived, lgd_output_result *facts,
                             ts_status *st)
{
    char path[TS_PATH_LENGTH];
    switch (which) {
    case 0: return TS_OK;
    case LGD_OUT_RENDER:
        return ts_path_in(path, t->folder, "render.png", st)
            ? st->code
            : lgd_write_render(path, t->estimate, t->photo, t->order->ambient, st);
    case LGD_OUT_PREVIEW:
        return ts_path_in(path, t->folder, "preview.png", st) ? st->code : lgd_write_preview(path, t->m, t->photo, st);
    case LGD_OUT_PAGE:
        return ts_path_in(path, t->folder, "view.html", st)
            ? st->code
            : lgd_write_page(path, t->stem, t->m, t->photo, t->order, st);
    case LGD_OUT_GLTF:
        return ts_path_in(path, t->folder, "material.gltf", st) ? st->code : lgd_write_gltf(path, &t->gltf, st);
    case LGD_OUT_MATERIALX:
        return ts_path_in(path, t->folder, "material.mtlx", st) ? st->code : lgd_write_materialx(path, st);
    default:
        return which & LGD_DERIVED ? lgd_write_derived(t->folder, derived, which, facts, st)
                                   : io_write_map_files(t->folder, t->m, map_bits(which), t->order->directx, 1, st);
    }
}

/* material.glb from the maps beside it, then those of them that nobody ordered are taken away. */
static ts_code write_glb(const task *t, unsigned written, ts_status *st)
{
    char path[TS_PATH_LENGTH];
    ts_code code = ts_path_in(path, t->folder, "material.glb", st);
    if (!code) code = lgd_write_glb(path, t->folder, &t->gltf, st);
    for (int k = 0; k < LGD_OUTPUTS && !code; k++)
        if (written & ~t->order->which & 1u << k && ts_path_in(path, t->folder, lgd_files[k], st) == TS_OK)
            unlink(path);
    return code;
}

typedef struct writing {
    const task *t;
    unsigned which;
    lgd_derived *derived;
    lgd_output_result *facts;
    ts_status *failure; /* of each portion */
} writing;

static void write_one(const void *job, int64_t i)
{
    const writing *w = job;
    write_portion(w->t, w->which & portions[i], w->derived, w->facts, &w->failure[i]);
}

/* What takes long all threads make together, one after the other: what is derived, and a maps.exr that is compressed.
 * Then each makes files. Of several failures the first portion's is reported. */
static ts_code write_portions(const task *t, unsigned which, lgd_output_result *facts, ts_status *st)
{
    lgd_derived derived;
    ts_status failure[PORTIONS] = {{0}};
    const unsigned first = t->order->half ? which & LGD_OUT_EXR : 0;
    const int threads = t->order->threads;
    ts_code code = lgd_derive(t->m, which, t->order->repeats, threads, &derived, facts, st);
    if (!code)
        code = io_write_map_files(t->folder, t->m, map_bits(first) | IO_MAPS_HALF, t->order->directx, threads, st);
    if (!code) ts_tasks(threads, PORTIONS, write_one, &(writing){t, which & ~first, &derived, facts, failure});
    for (int i = 0; i < PORTIONS && !code; i++)
        if (failure[i].code) code = ts_fail(st, failure[i].code, "%s", failure[i].message);
    lgd_derived_free(&derived);
    return code;
}

static ts_code write_all(const task *t, lgd_output_result *facts, ts_status *st)
{
    const bool glb = t->order->which & LGD_OUT_GLB;
    const unsigned which = t->order->which | (glb ? lgd_output_referred(t->order->metallic) : 0);
    if (write_portions(t, which, facts, st) != TS_OK) return st->code;
    if (glb && write_glb(t, which, st) != TS_OK) return st->code;
    char path[TS_PATH_LENGTH];
    return ts_path_in(path, t->folder, "meta.txt", st)
        ? st->code
        : lgd_write_meta(path, t->photo, t->order, facts, t->mark, NULL, 0, st);
}

enum { MARK = 40 };

/* The line of meta.txt that says which estimate the folder's files are of: a hash of the maps. */
static void mark_of(const io_material *m, bool directx, char mark[MARK])
{
    const size_t values = (size_t)m->size * (size_t)m->size * MAP_CHANNELS;
    snprintf(mark, MARK, "estimate: %016" PRIx64 "\n", ts_hash(m->maps, values * sizeof *m->maps, directx));
}

/* The bits of files that are in folder. */
static unsigned files_in(const char *folder, unsigned files)
{
    char path[TS_PATH_LENGTH];
    unsigned there = 0;
    for (int k = 0; k < LGD_OUTPUTS; k++)
        if (files >> k & 1 && ts_path_in(path, folder, lgd_files[k], NULL) == TS_OK && access(path, F_OK) == 0)
            there |= 1u << k;
    return there;
}

bool lgd_output_is(const char *folder, unsigned which, const char *record, char **meta)
{
    char *text = lgd_meta_read(folder);
    const bool is = text && strstr(text, record) && files_in(folder, which) == which;
    if (is) *meta = text;
    else free(text);
    return is;
}

static ts_code remove_files(const char *folder, unsigned files, unsigned *removed, ts_status *st)
{
    char path[TS_PATH_LENGTH];
    for (int k = 0; k < LGD_OUTPUTS; k++) {
        if (!(files >> k & 1) || ts_path_in(path, folder, lgd_files[k], st) != TS_OK) continue;
        if (unlink(path) == 0) *removed |= 1u << k;
        else if (errno != ENOENT && errno != EISDIR) /* a folder is nothing of ours */
            return ts_fail(st, TS_IO, "%s: cannot be removed: %s", path, strerror(errno));
    }
    return TS_OK;
}

/* Whether every file of which (bits) can be put into folder: a folder of its name is in the way. */
static ts_code check_room(const char *folder, unsigned which, ts_status *st)
{
    char path[TS_PATH_LENGTH];
    struct stat info;
    for (int k = 0; k < LGD_FILES; k++) {
        if (!(which >> k & 1)) continue;
        if (ts_path_in(path, folder, lgd_files[k], st) != TS_OK) return st->code;
        if (lstat(path, &info) == 0 && S_ISDIR(info.st_mode))
            return ts_fail(st, TS_IO, "%s: is in the way: it is a folder", path);
    }
    return TS_OK;
}

/* Puts a meta.txt in folder that says that its files are being replaced. It is made in the hidden folder: a link of
 * that name is replaced, not what it leads to. */
static ts_code begin_meta(const char *hidden, const char *folder, unsigned files, ts_status *st)
{
    char from[TS_PATH_LENGTH], to[TS_PATH_LENGTH];
    ts_code code = ts_path_in(from, hidden, "begun", st);
    if (!code) code = ts_path_in(to, folder, lgd_files[LGD_OUTPUTS], st);
    if (!code) code = lgd_write_meta_begun(from, files, st);
    if (!code && rename(from, to) != 0) code = ts_fail(st, TS_IO, "%s: cannot be replaced: %s", to, strerror(errno));
    return code;
}

/* Every complete file from the hidden folder over the one in folder, meta.txt last. What the folder's meta.txt names
 * stays where it is of the same estimate; else it is removed, facts->removed gets its bits, and until the end there is
 * a meta.txt that names what may be of either, so that what a killed process leaves is neither taken for whole nor for
 * somebody else's. No other file is touched. */
static ts_code move_files(const char *folder, const task *t, lgd_output_result *facts, ts_status *st)
{
    const char *hidden = t->folder, *meta = lgd_files[LGD_OUTPUTS];
    char whole[TS_PATH_LENGTH], *before = lgd_meta_read(folder);
    const bool same = before && strstr(before, t->mark);
    const unsigned fresh = files_in(hidden, ~0u), old = before ? lgd_meta_files(before) & ~fresh : 0,
                   kept = same ? files_in(folder, old) : 0;
    ts_code code = check_room(folder, fresh | 1u << LGD_OUTPUTS, st);
    if (!code) code = ts_path_in(whole, hidden, meta, st);
    if (!code && kept) code = lgd_write_meta(whole, t->photo, t->order, facts, t->mark, before, kept, st);
    free(before);
    if (!code && !same) code = begin_meta(hidden, folder, old | fresh, st);
    for (int k = 0; k < LGD_OUTPUTS && !code; k++)
        if (fresh >> k & 1) code = ts_move_file(hidden, folder, lgd_files[k], st);
    if (!code) code = remove_files(folder, old & ~kept, &facts->removed, st);
    if (code) return code;
    ts_sync_folder(folder);
    return ts_move_file(hidden, folder, meta, st);
}

/* One process at a time, so that the files that stay are of one run. Without locks they come in any order. */
static ts_code move_locked(const char *folder, const task *t, lgd_output_result *facts, ts_status *st)
{
    const int lock = open(folder, O_RDONLY | O_DIRECTORY | O_CLOEXEC);
    if (lock >= 0) (void)!flock(lock, LOCK_EX);
    const ts_code code = move_files(folder, t, facts, st);
    if (lock >= 0) close(lock);
    return code;
}

/* m: what is written; estimate: what the photograph is compared with. */
static ts_code write_folder(const char *parent, const char *stem, const io_material *m, const io_material *estimate,
                            const lgd_photo *photo, const lgd_order *order, lgd_output_result *r, ts_status *st)
{
    char folder[TS_PATH_LENGTH], mark[MARK], *hidden;
    struct stat info;
    int lock;
    if (ts_path_in(folder, parent, stem, st) != TS_OK) return st->code;
    const bool there = stat(folder, &info) == 0;
    if (there && !S_ISDIR(info.st_mode)) return ts_fail(st, TS_IO, "%s: is in the way: it is not a folder", folder);
    if (there) ts_sweep(folder);
    /* inside the folder when it exists: it may lie on another file system than its parent */
    if (ts_hidden_folder(there ? folder : parent, &hidden, &lock, st) != TS_OK) return st->code;
    mark_of(m, order->directx, mark);
    const task t = {
        hidden, stem, m, estimate, photo, order, {order->metallic, order->repeats, stem, order->which & LGD_OUT_AO},
        mark};
    ts_code code = write_all(&t, r, st);
    bool moves = there;
    if (!code && !there && rename(hidden, folder) != 0) {
        if (errno == ENOTEMPTY || errno == EEXIST) moves = true; /* another process has made it meanwhile */
        else code = ts_fail(st, TS_IO, "%s: cannot be made: %s", folder, strerror(errno));
    }
    if (!code && moves) code = move_locked(folder, &t, r, st);
    if (code || moves) ts_hidden_folder_remove(hidden, &lock);
    else close(lock);
    free(hidden);
    if (!code) ts_sync_folder(folder);
    if (!code && !there) ts_sync_folder(parent);
    return code;
}

ts_code lgd_output_write(const char *parent, const char *stem, const io_material *estimate, const lgd_photo *photo,
                         const lgd_order *order, lgd_output_result *result, ts_status *st)
{
    lgd_output_result ignored, *r = result ? result : &ignored;
    io_material tile = {0};
    *r = (lgd_output_result){0};
    ts_code code = order->repeats ? io_seamless(estimate, &tile, order->threads, st) : TS_OK;
    if (!code) code = write_folder(parent, stem, order->repeats ? &tile : estimate, estimate, photo, order, r, st);
    io_material_free(&tile);
    return code;
}
