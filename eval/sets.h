/* What is evaluated: materials with known maps, and captures. */
#ifndef EV_SETS_H
#define EV_SETS_H
#include "data/capture.h"
#include "data/material.h"

typedef enum ev_kind {
    EV_PROCEDURAL,
    EV_STRIPS,
    EV_MAPS,
    EV_MULTIVIEW,
    EV_PHOTOS,
    EV_PEERS,
    EV_UNDER_SHEET,
    EV_UNDER_SHEET_EXACT,
    EV_KINDS
} ev_kind;

typedef struct ev_set {
    char *spec; /* as given: KIND:WHERE */
    ev_kind kind;
    const char *where;       /* into spec */
    uint64_t seed, families; /* EV_PROCEDURAL; families as in io_procedural */
    int count;
    io_map_convention option, convention; /* EV_MAPS: what the options say, and with set.ini */
    const char *peers;                    /* EV_PHOTOS: a folder of a peer's maps, or NULL */
    char **entry;                         /* the names in the folder, sorted; NULL for EV_PROCEDURAL */
} ev_set;

/* procedural:SEED,COUNT[,FAMILY...] (classic families without a list: io_family_mask), strips:FOLDER (a folder of strip
 * images), maps:FOLDER (a folder of map folders), multiview:FOLDER (a capture, or a folder of them), photos:FOLDER
 * (photographs), peers:FOLDER (images of nine panels, eval/panels.h), sheets:FOLDER or sheets-exact:FOLDER (a folder of
 * photographs under a printed sheet, eval/under_sheet.h). Conventions of map folders come from given (the
 * options, may be NULL), else from set.ini (eval/set_ini.h) in the map folder, else from set.ini in FOLDER. The caller
 * closes it after success. TS_INVALID for a wrong spec, TS_IO for a folder that cannot be read or holds nothing of that
 * kind. */
ts_code ev_set_open(const char *spec, const io_map_convention *given, ev_set *set, ts_status *st);
void ev_set_close(ev_set *set);

/* Material number i of 0 .. count-1, size x size pixels; m->name is its name within the set. m is zeroed or a material
 * to be reused. Of EV_PROCEDURAL, EV_STRIPS and EV_MAPS. */
ts_code ev_set_load(const ev_set *set, int i, int size, io_material *m, ts_status *st);
/* The same of an EV_MULTIVIEW set. */
ts_code ev_set_load_capture(const ev_set *set, int i, int size, io_capture *c, ts_status *st);

/* The same of EV_UNDER_SHEET and EV_UNDER_SHEET_EXACT: the maps, and `inputs` windows under known lights (at least). */
ts_code ev_set_load_under_sheet(const ev_set *set, int i, int inputs, int size, io_material *truth, io_capture *c,
                                ts_status *st);

/* The same of EV_PHOTOS and EV_PEERS: image is linear, size x size x 3, malloced and the caller's. truth is empty
 * (size 0) of a photograph, peer where nothing has its name. fov: as the file says it (io_lens_fov), or 0. */
ts_code ev_set_load_photo(const ev_set *set, int i, int size, float **image, double *fov, io_material *truth,
                          io_material *peer, ts_status *st);

/* Whether ev_set_load_photo finds a peer's maps of material i; false of the other kinds. */
bool ev_set_has_peer(const ev_set *set, int i);

/* A number of the material, independent of its place in the set: the seed of its evaluation views. The same of both
 * kinds under a sheet. */
uint64_t ev_set_identity(const ev_set *set, int i);
#endif
