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

ts_code ev_usable_options(const ev_command *c, const ev_set *set, ts_status *st)
{
    const unsigned photos = 1u << EV_PHOTOS;
    if (!c->peer_maps) return TS_OK;
    if (!has_kind(set, c->sets, photos))
        return ts_fail(st, TS_INVALID, "--peer-maps: they are of photographs: give --set photos:FOLDER too");
    DIR *d = opendir(c->peer_maps);
    if (!d) return ts_fail(st, TS_IO, "--peer-maps %s: cannot be read: %s", c->peer_maps, strerror(errno));
    closedir(d);
    if (has_peers(set, c->sets, photos)) return TS_OK;
    return ts_fail(st, TS_IO, "--peer-maps %s: has maps of none of the photographs: those of NAME.jpg are in NAME.png",
                   c->peer_maps);
}

ts_code ev_usable_methods(const ev_estimator *method, int methods, const ev_set *set, int sets, ts_status *st)
{
    for (int m = 0; m < methods; m++)
        if (method[m].method->peer && !has_peers(set, sets, 1u << EV_PHOTOS | 1u << EV_PEERS))
            return ts_fail(
                st, TS_INVALID,
                "--method %s: no set has a peer's maps: give --set peers:FOLDER, or photos:FOLDER and --peer-maps",
                method[m].label);
    return TS_OK;
}
