/* The parts of the map folder reader: which file is which map, and what the files mean. */
#ifndef IO_MAP_FOLDER_H
#define IO_MAP_FOLDER_H
#include "data/material.h"

enum {
    IO_BASECOLOR,
    IO_DIFFUSE_MAP,
    IO_NORMAL_MAP,
    IO_ROUGHNESS_MAP,
    IO_GLOSS_MAP,
    IO_METALLIC_MAP,
    IO_SPECULAR_MAP,
    IO_MAP_KINDS
};
extern const char *const io_map_kind_name[IO_MAP_KINDS];

typedef struct io_map_set {
    char file[IO_MAP_KINDS][256]; /* names inside the folder; empty: there is none */
    bool linear[IO_MAP_KINDS];    /* of colour maps: stored linear (otherwise as the file says, sRGB by default) */
    bool packed[IO_MAP_KINDS];    /* of one channel: its name is of several, and one picture may hold them all */
    bool specular;                /* the workflow: diffuse and specular, otherwise base colour and metallic */
    bool directx;                 /* the normal's y points down */
} io_map_set;

/* Reads the folder's names and its meta.txt; given (may be NULL) holds the options, which win. */
ts_code io_describe_map_folder(const char *path, const io_map_convention *given, io_map_set *set, ts_status *st);
#endif
