#include "infer/output.h"
#include "infer/panels.h"
#include "render/scene.h"
#include <errno.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

enum { PATH_LENGTH = 4096 };

const char *const lgd_files[LGD_FILES] = {"diffuse.png", "specular.png", "roughness.png", "normal.png", "maps.exr", "meta.txt", "render.png", "preview.png"};

/* folder/name; TS_INVALID when it is too long. */
static ts_code join(char path[PATH_LENGTH], const char *folder, const char *name, ts_status *st)
{
    if (snprintf(path, PATH_LENGTH, "%s/%s", folder, name) >= PATH_LENGTH) return ts_fail(st, TS_INVALID, "%.200s...: the name is too long", folder);
    return TS_OK;
}

/* A new hidden folder in parent, one that no other process and no killed one has. */
static ts_code make_hidden(const char *parent, char path[PATH_LENGTH], ts_status *st)
{
    char name[64];
    for (int i = 0; i < 1000; i++) {
        snprintf(name, sizeof name, ".lgd-infer-%ld-%d", (long)getpid(), i);
        if (join(path, parent, name, st) != TS_OK) return st->code;
        if (mkdir(path, 0777) == 0) return TS_OK;
        if (errno != EEXIST) break;
    }
    return ts_fail(st, TS_IO, "%s: nothing can be written there: %s", parent, strerror(errno));
}

static void remove_hidden(const char *hidden)
{
    char path[PATH_LENGTH];
    for (int i = 0; i < LGD_FILES; i++)
        if (join(path, hidden, lgd_files[i], NULL) == TS_OK) unlink(path);
    rmdir(hidden);
}

ts_code lgd_output_check(const char *folder, ts_status *st)
{
    char hidden[PATH_LENGTH];
    const ts_code code = make_hidden(folder, hidden, st);
    if (!code) rmdir(hidden);
    return code;
}

static ts_code write_pictures(const char *folder, const io_material *m, const io_image *photo, ts_status *st)
{
    const int size = m->size;
    char path[PATH_LENGTH];
    io_image pair = {0}, strip = {0}, picture = {0};
    ts_code code = io_image_create(&pair, 2 * size, size, 3, st);
    if (!code) code = io_image_create(&strip, LGD_PREVIEW_LIGHTS * size, size, 3, st);
    if (!code) code = io_image_create(&picture, size, size, 3, st);
    if (!code) {
        const rd_view flash = rd_flash();
        lgd_panel_put(&pair, size, 0, 0, photo->data);
        lgd_panel_render(&pair, 1, 0, m, &flash, picture.data);
        for (int i = 0; i < LGD_PREVIEW_LIGHTS; i++) {
            const rd_view view = rd_preview_view(i, LGD_PREVIEW_LIGHTS);
            lgd_panel_render(&strip, i, 0, m, &view, picture.data);
        }
        code = join(path, folder, "render.png", st);
        if (!code) code = io_write_png(path, &pair, 8, true, st);
        if (!code) code = join(path, folder, "preview.png", st);
        if (!code) code = io_write_png(path, &strip, 8, true, st);
    }
    io_image_free(&pair);
    io_image_free(&strip);
    io_image_free(&picture);
    return code;
}

/* Every complete file from the hidden folder over the one in folder. */
static ts_code move_files(const char *hidden, const char *folder, ts_status *st)
{
    char from[PATH_LENGTH], to[PATH_LENGTH];
    for (int i = 0; i < LGD_FILES; i++) {
        if (join(from, hidden, lgd_files[i], st) != TS_OK || join(to, folder, lgd_files[i], st) != TS_OK) return st->code;
        if (rename(from, to) != 0) return ts_fail(st, TS_IO, "%s: cannot be replaced: %s", to, strerror(errno));
    }
    return TS_OK;
}

ts_code lgd_output_write(const char *parent, const char *stem, const io_material *m, const io_image *photo, bool directx, ts_status *st)
{
    char folder[PATH_LENGTH], hidden[PATH_LENGTH];
    struct stat info;
    if (join(folder, parent, stem, st) != TS_OK) return st->code;
    const bool there = stat(folder, &info) == 0;
    if (there && !S_ISDIR(info.st_mode)) return ts_fail(st, TS_IO, "%s: is in the way: it is not a folder", folder);
    /* inside the folder when it exists: it may lie on another file system than its parent */
    if (make_hidden(there ? folder : parent, hidden, st) != TS_OK) return st->code;
    ts_code code = io_write_maps(hidden, m, IO_MAPS_ALL, directx, st);
    if (!code) code = write_pictures(hidden, m, photo, st);
    if (!code && there) code = move_files(hidden, folder, st);
    else if (!code && rename(hidden, folder) != 0) code = ts_fail(st, TS_IO, "%s: cannot be made: %s", folder, strerror(errno));
    if (code || there) remove_hidden(hidden);
    return code;
}
