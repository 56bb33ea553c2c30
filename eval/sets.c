#include "eval/sets.h"
#include "data/materials/procedural.h"
#include "data/name.h"
#include "eval/panels.h"
#include "eval/set_ini.h"
#include "eval/under_sheet.h"
#include <dirent.h>
#include <errno.h>
#include <inttypes.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

enum { PATH_LENGTH = 4096, COUNT_MAX = 1000000 };

static const char *const kind_name[EV_KINDS] = {"procedural", "strips", "maps",   "multiview",
                                                "photos",     "peers",  "sheets", "sheets-exact"};

static int by_name(const void *a, const void *b) { return strcmp(*(char *const *)a, *(char *const *)b); }

static bool of_images(const ev_set *set)
{
    return set->kind == EV_STRIPS || set->kind == EV_PHOTOS || set->kind == EV_PEERS;
}

/* Whether the folder's entry is a material of that kind. Hidden files are not. */
static bool belongs(const ev_set *set, const char *name)
{
    char path[PATH_LENGTH];
    struct stat info;
    if (name[0] == '.' || snprintf(path, sizeof path, "%s/%s", set->where, name) >= (int)sizeof path ||
        stat(path, &info) != 0)
        return false;
    if (set->kind == EV_MAPS) return S_ISDIR(info.st_mode);
    if (set->kind == EV_MULTIVIEW) return S_ISDIR(info.st_mode) && io_is_capture(path);
    if (set->kind == EV_UNDER_SHEET || set->kind == EV_UNDER_SHEET_EXACT)
        return S_ISDIR(info.st_mode) && ev_is_under_sheet(path);
    return io_is_image_name(name) && S_ISREG(info.st_mode);
}

/* Results and pictures go by the names without extensions. */
static ts_code check_names(const ev_set *set, ts_status *st)
{
    char stem[PATH_LENGTH], other[PATH_LENGTH];
    for (int i = 0; i < set->count; i++) {
        io_name_from_path(set->entry[i], stem, sizeof stem);
        for (int j = i + 1; j < set->count && !strncmp(set->entry[j], stem, strlen(stem)); j++) {
            io_name_from_path(set->entry[j], other, sizeof other);
            if (!strcmp(stem, other))
                return ts_fail(st, TS_INVALID, "%s: %s and %s would have the same name in the results: rename one",
                               set->where, set->entry[i], set->entry[j]);
        }
    }
    return TS_OK;
}

static ts_code list_folder(ev_set *set, ts_status *st)
{
    DIR *d = opendir(set->where);
    if (!d) return ts_fail(st, TS_IO, "%s: cannot be read: %s", set->where, strerror(errno));
    ts_code code = TS_OK;
    int capacity = 0;
    for (struct dirent *e; !code && (e = readdir(d));) {
        if (!belongs(set, e->d_name)) continue;
        if (set->count == capacity) {
            capacity = capacity ? 2 * capacity : 64;
            char **more = realloc(set->entry, (size_t)capacity * sizeof *more);
            if (!more) code = ts_fail(st, TS_NOMEM, "%s: out of memory", set->where);
            else set->entry = more;
        }
        if (!code && !(set->entry[set->count] = strdup(e->d_name)))
            code = ts_fail(st, TS_NOMEM, "%s: out of memory", set->where);
        if (!code) set->count++;
    }
    closedir(d);
    if (!code && set->count == 0)
        code = ts_fail(st, TS_IO, "%s: there is no %s in this folder", set->where,
                       set->kind == EV_MAPS         ? "map folder"
                           : set->kind == EV_STRIPS ? "strip image"
                           : set->kind == EV_PHOTOS ? "photograph"
                           : set->kind == EV_PEERS  ? "image of nine panels"
                           : set->kind >= EV_UNDER_SHEET
                           ? "folder with maps/ and photo_1.jpg, as lgd-data --format sheet-captures writes them"
                           : "capture (a folder with 00.png, camera_pos.txt ...)");
    if (!code) qsort(set->entry, (size_t)set->count, sizeof *set->entry, by_name);
    return code || !of_images(set) ? code : check_names(set, st);
}

static ts_code parse_procedural(ev_set *set, ts_status *st)
{
    char *end;
    errno = 0;
    const bool digit = set->where[0] >= '0' && set->where[0] <= '9';
    set->seed = strtoull(set->where, &end, 10);
    const bool seed = digit && !errno && end[0] == ',' && end[1] >= '0' && end[1] <= '9';
    const long count = seed ? strtol(end + 1, &end, 10) : 0;
    if (!seed || errno || (*end && *end != ',') || count < 1 || count > COUNT_MAX)
        return ts_fail(st, TS_INVALID, "--set %s: should be procedural:SEED,COUNT with COUNT in 1 .. %d", set->spec,
                       COUNT_MAX);
    set->count = (int)count;
    set->families = *end ? 0 : io_family_mask("classic");
    while (*end) {
        char name[64];
        const size_t n = strcspn(++end, ",");
        snprintf(name, sizeof name, "%.*s", (int)n, end);
        const uint64_t bits = n < sizeof name ? io_family_mask(name) : 0;
        if (!bits)
            return ts_fail(st, TS_INVALID, "--set %s: there is no family \"%s\" (lgd-data --help lists them)",
                           set->spec, name);
        set->families |= bits;
        end += n;
    }
    return TS_OK;
}

/* A folder that is a capture itself is a set of one, with an empty name inside it. */
static ts_code list_captures(ev_set *set, ts_status *st)
{
    if (!io_is_capture(set->where)) return list_folder(set, st);
    set->entry = calloc(1, sizeof *set->entry);
    if (!set->entry || !(set->entry[0] = strdup(""))) return ts_fail(st, TS_NOMEM, "%s: out of memory", set->where);
    set->count = 1;
    return TS_OK;
}

ts_code ev_set_open(const char *spec, const io_map_convention *given, ev_set *set, ts_status *st)
{
    *set = (ev_set){.spec = strdup(spec), .kind = EV_KINDS};
    if (!set->spec) return ts_fail(st, TS_NOMEM, "--set %s: out of memory", spec);
    const char *colon = strchr(set->spec, ':');
    for (int k = 0; colon && k < EV_KINDS; k++)
        if (strlen(kind_name[k]) == (size_t)(colon - set->spec) &&
            strncmp(kind_name[k], set->spec, (size_t)(colon - set->spec)) == 0)
            set->kind = (ev_kind)k;
    ts_code code = TS_OK;
    if (set->kind == EV_KINDS || !colon[1])
        code = ts_fail(st, TS_INVALID,
                       "--set %s: should be procedural:SEED,COUNT, strips:FOLDER, maps:FOLDER, multiview:FOLDER, "
                       "photos:FOLDER, peers:FOLDER, sheets:FOLDER or sheets-exact:FOLDER",
                       spec);
    else {
        set->where = colon + 1;
        code = set->kind == EV_PROCEDURAL ? parse_procedural(set, st)
            : set->kind == EV_MULTIVIEW   ? list_captures(set, st)
                                          : list_folder(set, st);
        if (!code && set->kind == EV_MAPS) code = ev_set_ini(set->where, given, &set->convention, st);
        if (given) set->option = *given;
    }
    if (code) ev_set_close(set);
    return code;
}

void ev_set_close(ev_set *set)
{
    for (int i = 0; set->entry && i < set->count; i++) free(set->entry[i]);
    free(set->entry);
    free(set->spec);
    *set = (ev_set){0};
}

uint64_t ev_set_identity(const ev_set *set, int i)
{
    char text[PATH_LENGTH];
    if (set->kind == EV_PROCEDURAL)
        snprintf(text, sizeof text, "%s %" PRIu64 " %d", kind_name[set->kind], set->seed, i);
    else
        snprintf(text, sizeof text, "%s %s", kind_name[set->kind == EV_UNDER_SHEET_EXACT ? EV_UNDER_SHEET : set->kind],
                 set->entry[i]);                  /* a lone capture has no views to draw */
    uint64_t hash = UINT64_C(0xcbf29ce484222325); /* FNV-1a */
    for (const char *c = text; *c; c++) hash = (hash ^ (unsigned char)*c) * UINT64_C(0x100000001b3);
    return hash;
}

static ts_code load_maps(const ev_set *set, const char *path, int size, io_material *m, ts_status *st)
{
    io_map_convention own;
    const ts_code code = ev_set_ini(path, &set->option, &own, st);
    if (code) return code;
    if (!own.normal) own.normal = set->convention.normal;
    if (!own.workflow) own.workflow = set->convention.workflow;
    if (!own.colour) own.colour = set->convention.colour;
    return io_read_map_folder(path, &own, size, m, st);
}

ts_code ev_set_load(const ev_set *set, int i, int size, io_material *m, ts_status *st)
{
    io_material_free(m);
    if (set->kind == EV_PROCEDURAL) {
        const io_procedural p = {.seed = set->seed, .families = set->families};
        const ts_code code = io_material_create(m, size, st);
        if (code) return code;
        io_procedural_make(&p, (uint64_t)i, m);
        snprintf(m->name, sizeof m->name, "%06d", i);
        return TS_OK;
    }
    char path[PATH_LENGTH];
    if (snprintf(path, sizeof path, "%s/%s", set->where, set->entry[i]) >= (int)sizeof path)
        return ts_fail(st, TS_INVALID, "%s: the name is too long", set->where);
    const ts_code code = set->kind == EV_STRIPS ? io_read_strip(path, size, m, NULL, st)
                                                : load_maps(set, path, size, m, st);
    if (code) return code;
    snprintf(m->name, sizeof m->name, "%s", set->entry[i]);
    char *dot = set->kind == EV_STRIPS ? strrchr(m->name, '.') : NULL;
    if (dot) *dot = 0;
    return TS_OK;
}

ts_code ev_set_load_capture(const ev_set *set, int i, int size, io_capture *c, ts_status *st)
{
    char path[PATH_LENGTH];
    io_capture_free(c);
    if (snprintf(path, sizeof path, "%s%s%s", set->where, *set->entry[i] ? "/" : "", set->entry[i]) >= (int)sizeof path)
        return ts_fail(st, TS_INVALID, "%s: the name is too long", set->where);
    const ts_code code = io_read_capture(path, size, IO_MAX_PIXELS_DEFAULT, c, st);
    if (!code && c->images < 2)
        return ts_fail(st, TS_FORMAT, "%s: has one picture: one is the input, the others are compared", path);
    return code;
}

static ts_code entry_path(const ev_set *set, const char *folder, const char *entry, char path[PATH_LENGTH],
                          ts_status *st)
{
    if (snprintf(path, PATH_LENGTH, "%s/%s", folder, entry) < PATH_LENGTH) return TS_OK;
    return ts_fail(st, TS_INVALID, "%s: the name is too long", set->where);
}

/* Where a peer's maps of photograph i would be. */
static ts_code peer_path(const ev_set *set, int i, char path[PATH_LENGTH], ts_status *st)
{
    char stem[sizeof((io_material *)0)->name], name[sizeof stem + 4];
    io_name_from_path(set->entry[i], stem, sizeof stem);
    snprintf(name, sizeof name, "%s.png", stem);
    return entry_path(set, set->peers, name, path, st);
}

bool ev_set_has_peer(const ev_set *set, int i)
{
    char path[PATH_LENGTH];
    if (set->kind != EV_PHOTOS || !set->peers) return set->kind == EV_PEERS;
    return peer_path(set, i, path, NULL) == TS_OK && access(path, F_OK) == 0;
}

ts_code ev_set_load_photo(const ev_set *set, int i, int size, float **image, double *fov, io_material *truth,
                          io_material *peer, ts_status *st)
{
    char path[PATH_LENGTH], from[128];
    io_photo_facts facts;
    io_image square;
    *image = NULL;
    *fov = 0;
    io_material_free(truth);
    io_material_free(peer);
    ts_code code = entry_path(set, set->where, set->entry[i], path, st);
    if (code) return code;
    if (set->kind == EV_PEERS) return ev_read_nine_panels(path, size, image, truth, peer, st);
    code = io_read_photo_square(path, IO_MAX_PIXELS_DEFAULT, size, 0, &square, &facts, st);
    if (code) return code;
    *fov = io_lens_fov(&facts.lens, facts.width, facts.height, from, sizeof from);
    *image = square.data;
    io_name_from_path(path, truth->name, sizeof truth->name);
    if (!set->peers) return TS_OK;
    code = peer_path(set, i, path, st);
    return code || access(path, F_OK) != 0 ? code : ev_read_four_panels(path, size, peer, st);
}

ts_code ev_set_load_under_sheet(const ev_set *set, int i, int inputs, int size, io_material *truth, io_capture *c,
                                ts_status *st)
{
    char path[PATH_LENGTH];
    const ts_code code = entry_path(set, set->where, set->entry[i], path, st);
    if (code) return code;
    if (ev_load_under_sheet(path, &set->option, set->kind == EV_UNDER_SHEET_EXACT, inputs, size, truth, c, st) != TS_OK)
        return st->code;
    snprintf(truth->name, sizeof truth->name, "%s", set->entry[i]);
    return TS_OK;
}
