#include "eval/under_sheet.h"
#include "infer/capture.h"
#include "infer/sheet.h"
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

enum { PATH_LENGTH = 4096 };

static bool inside(const char *folder, const char *name, char path[PATH_LENGTH])
{
    return snprintf(path, PATH_LENGTH, "%s/%s", folder, name) < PATH_LENGTH && access(path, F_OK) == 0;
}

bool ev_is_under_sheet(const char *folder)
{
    char path[PATH_LENGTH];
    return inside(folder, "maps", path) && inside(folder, "photo_1.jpg", path);
}

/* What lgd-infer --sheet makes of them. */
static ts_code read_photographs(char *const *paths, int count, int most, int size, io_capture *c, ts_status *st)
{
    io_sheet_set set;
    if (io_sheet_set_read(paths, count, 0, IO_MAX_PIXELS_DEFAULT, 0, NULL, &set, st) != TS_OK) return st->code;
    ts_code code = TS_OK;
    for (int i = 0; i < count && !code; i++)
        if (set.photo[i].st.code) {
            *st = set.photo[i].st;
            code = st->code;
        }
    if (!code) code = lgd_sheet_capture(&set, most, size, IO_MAX_PIXELS_DEFAULT, 0, c, st);
    io_sheet_set_free(&set);
    return code;
}

static ts_code find_photographs(const char *folder, int most, int size, io_capture *c, ts_status *st)
{
    char *path[IO_SOLVE_MOST], full[PATH_LENGTH];
    int count = 0;
    ts_code code = TS_OK;
    while (count < IO_SOLVE_MOST && !code) {
        char name[32];
        snprintf(name, sizeof name, "photo_%d.jpg", count + 1);
        if (!inside(folder, name, full)) break;
        if (!(path[count] = strdup(full))) code = ts_fail(st, TS_NOMEM, "%s: out of memory", folder);
        else count++;
    }
    if (!code) code = read_photographs(path, count, most, size, c, st);
    for (int i = 0; i < count; i++) free(path[i]);
    return code;
}

ts_code ev_load_under_sheet(const char *folder, const io_map_convention *own, bool exact, int most, int size,
                            io_material *truth, io_capture *c, ts_status *st)
{
    char path[PATH_LENGTH];
    io_material_free(truth);
    io_capture_free(c);
    if (snprintf(path, sizeof path, "%s/maps", folder) >= (int)sizeof path)
        return ts_fail(st, TS_INVALID, "%s: the name is too long", folder);
    ts_code code = io_read_map_folder(path, own, size, truth, st);
    if (code) return code;
    if (exact) {
        snprintf(path, sizeof path, "%s/exact", folder);
        code = lgd_read_capture(path, size, IO_MAX_PIXELS_DEFAULT, false, c, st);
    } else code = find_photographs(folder, most, size, c, st);
    if (!code && c->images < most)
        code = ts_fail(st, TS_FORMAT, "%s: has %d photographs of the %d that are read", folder, c->images, most);
    if (!code) return TS_OK;
    io_material_free(truth);
    io_capture_free(c);
    return code;
}
