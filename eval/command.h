/* lgd-eval's command line. */
#ifndef EV_COMMAND_H
#define EV_COMMAND_H
#include "data/camera.h"
#include "data/material.h"

enum { EV_SETS_MAX = 64, EV_METHODS_MAX = 64 };

typedef struct ev_command {
    const char *out, *model, *lpips[2], *spec[EV_SETS_MAX], *method[EV_METHODS_MAX];
    int sets, methods, iterations, threads, size, repeat;
    int64_t seed;
    const char *peer_maps;
    double noise, exposure, fov, tilt, light[2]; /* exposure and fov 0: not given */
    const char *camera_spec;
    io_camera camera;  /* of known materials, where photographed: camera_spec's */
    int shard, shards; /* part shard of 1 .. shards of the materials; shards 0: all */
    io_map_convention convention;
    bool light_known, light_unknown, photographed, images, fast, exact, pin, tune, pareto, iterations_figure,
        methods_figure, quiet, help, version;
} ev_command;

/* TS_INVALID with a message that names the option. The strings are argv's. */
ts_code ev_command_parse(int argc, char **argv, ev_command *c, ts_status *st);
void ev_command_help(void);
#endif
