#include "eval/usable.h"
#include <dirent.h>
#include <errno.h>
#include <string.h>

/* Kinds are bits 1 << ev_kind. */
static bool has_kind(const ev_set *set, int sets, unsigned kinds)
{
    for (int s = 0; s < sets; s++)
        if (kinds >> set[s].kind & 1) return true;
    return false;
}

static bool has_peers(const ev_set *set, int sets, unsigned kinds)
{
    for (int s = 0; s < sets; s++)
        for (int i = 0; i < set[s].count && kinds >> set[s].kind & 1; i++)
            if (ev_set_has_peer(&set[s], i)) return true;
    return false;
}

/* An option and the kinds of sets that use it. */
typedef struct use {
    const char *option;
    bool given;
    unsigned kinds;
    const char *sets;
} use;

static ts_code check_uses(const ev_command *c, const ev_set *set, ts_status *st)
{
    /* rendered: their photographs are made here, and told unless --camera or --untold is given */
    const unsigned rendered = 1u << EV_PROCEDURAL | 1u << EV_STRIPS | 1u << EV_MAPS, captures = 1u << EV_MULTIVIEW,
                   sheets = 1u << EV_UNDER_SHEET | 1u << EV_UNDER_SHEET_EXACT, photos = 1u << EV_PHOTOS,
                   folders = 1u << EV_MAPS | sheets;
    const char *const maps = "map folders (maps:)", *const made = "generated materials, strips or map folders",
                      *const scored = "a set of another kind";
    const use uses[] = {
        {"peer-maps", c->peer_maps, photos, "photographs (photos:)"},
        {"noise", c->noise > 0, rendered, made},
        {"light", c->light[0] != 0 || c->light[1] != 0, rendered, made},
        {"fov", c->fov > 0, rendered, made},
        {"tilt", c->tilt > 0, rendered, made},
        {"exposure", c->exposure > 0, rendered, made},
        {"camera", c->photographed, rendered, made},
        {"untold", c->light_unknown, rendered | sheets, "generated materials, strips, map folders or sheets"},
        {"normal", c->convention.normal != IO_NORMAL_FROM_FILE, folders, maps},
        {"workflow", c->convention.workflow != IO_WORKFLOW_FROM_FILE, folders, maps},
        {"colour", c->convention.colour != IO_ENCODING_FROM_FILE, folders, maps},
        {"told", c->light_known, captures | (c->photographed ? rendered : 0), "captures (multiview:), or --camera"},
        {"tune", c->tune, ~photos, scored}, /* photographs without known maps have no error */
        {"pareto", c->pareto, ~photos, scored},
        {"figure", c->iterations_figure || c->methods_figure, ~photos, scored},
    };
    for (size_t i = 0; i < sizeof uses / sizeof *uses; i++)
        if (uses[i].given && !has_kind(set, c->sets, uses[i].kinds))
            return ts_fail(st, TS_INVALID, "--%s: no set that is given uses it: leave it out, or add %s",
                           uses[i].option, uses[i].sets);
    return TS_OK;
}

ts_code ev_usable_options(const ev_command *c, const ev_set *set, ts_status *st)
{
    const unsigned photos = 1u << EV_PHOTOS;
    if (check_uses(c, set, st) != TS_OK) return st->code;
    if (!c->peer_maps) return TS_OK;
    DIR *d = opendir(c->peer_maps);
    if (!d) return ts_fail(st, TS_IO, "--peer-maps %s: cannot be read: %s", c->peer_maps, strerror(errno));
    closedir(d);
    if (has_peers(set, c->sets, photos)) return TS_OK;
    return ts_fail(st, TS_IO, "--peer-maps %s: has maps of none of the photographs: those of NAME.jpg are in NAME.png",
                   c->peer_maps);
}

ts_code ev_usable_methods(const ev_command *c, const ev_estimator *method, int methods, const ev_set *set,
                          ts_status *st)
{
    const unsigned alone = 1u << EV_PHOTOS | 1u << EV_PEERS; /* one photograph of each material */
    bool refines = methods == 0;
    for (int m = 0; m < methods; m++) {
        if (method[m].method->peer && !has_peers(set, c->sets, alone))
            return ts_fail(
                st, TS_INVALID,
                "--method %s: no set has a peer's maps: give --set peers:FOLDER, or photos:FOLDER and --peer-maps",
                method[m].label);
        for (int s = 0; s < c->sets && ev_asked_photos(&method[m]) > 1; s++)
            if (alone >> set[s].kind & 1)
                return ts_fail(st, TS_INVALID,
                               "--method %s: reads %d photographs, and --set %s has one of each material: leave out "
                               "photos=, or the set",
                               method[m].label, ev_asked_photos(&method[m]), set[s].spec);
        refines = refines || ev_has_iterations(&method[m]);
    }
    if (c->iterations >= 0 && !refines)
        return ts_fail(st, TS_INVALID, "--iterations: no method that is given has iterations: leave it out");
    return TS_OK;
}
