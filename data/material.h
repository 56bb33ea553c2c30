/* Materials: maps [size, size, 9] in the encoding of tensor/maps.h, from files or procedures. */
#ifndef IO_MATERIAL_H
#define IO_MATERIAL_H
#include "data/image/image.h"
#include "data/texel.h"
#include "tensor/maps.h"
#include <stdio.h>

typedef struct io_material {
    int size;
    float *maps; /* owned, [size][size][MAP_CHANNELS] */
    char name[128];
} io_material;

/* size: 1 .. 32768. The values of the maps are not set: whoever makes a material writes all of them. */
ts_code io_material_create(io_material *m, int size, ts_status *st);
void io_material_free(io_material *m);

/* A map folder: basecolor/albedo/diffuse, normal, roughness, metallic or specular; conventions from meta.txt (see the
 * reader) or from the options; ambiguity is an error, and so are maps of several shapes, whatever their sizes.
 * Resampled to size (0: the largest map's centre square). The option wins over a meta.txt, which io_write_maps writes
 * and data/map_names.c describes. */
typedef enum io_normal { IO_NORMAL_FROM_FILE, IO_NORMAL_GL, IO_NORMAL_DX } io_normal;
typedef enum io_workflow { IO_WORKFLOW_FROM_FILE, IO_WORKFLOW_METALLIC, IO_WORKFLOW_SPECULAR } io_workflow;
typedef enum io_encoding {
    IO_ENCODING_FROM_FILE,
    IO_ENCODING_SRGB,
    IO_ENCODING_LINEAR
} io_encoding; /* of colour maps */
typedef struct io_map_convention {
    io_normal normal;
    io_workflow workflow;
    io_encoding colour;
} io_map_convention;
/* given: conventions from options, or NULL: from the folder. */
ts_code io_read_map_folder(const char *path, const io_map_convention *given, int size, io_material *m, ts_status *st);

/* A strip: equal square panels side by side: input | normal | diffuse | roughness | specular, all linear, OpenGL y.
 * input (may be NULL) gets the first panel, linear. */
ts_code io_read_strip(const char *path, int size, io_material *m, io_image *input, ts_status *st);

/* diffuse.png, specular.png (sRGB), roughness.png, normal.png (linear, 16 bit where it matters) and maps.exr (all
 * channels linear float) into the folder; with masks from IO_MAPS_... and the normal's y flipped for DirectX, in
 * maps.exr too. A meta.txt beside them states the conventions, so that io_read_map_folder needs no options. */
enum {
    IO_MAPS_DIFFUSE = 1,
    IO_MAPS_SPECULAR = 2,
    IO_MAPS_ROUGHNESS = 4,
    IO_MAPS_NORMAL = 8,
    IO_MAPS_EXR = 16,
    IO_MAPS_ALL = 31,
    IO_MAPS_HALF = 32 /* maps.exr in half floats (data/image/exr.h) */
};
ts_code io_write_maps(const char *folder, const io_material *m, unsigned which, bool directx, ts_status *st);
/* The two halves of it: the files alone (from several threads at once too, for different files; threads: that maps.exr
 * is made on, 0: the process's number), the meta.txt alone. */
ts_code io_write_map_files(const char *folder, const io_material *m, unsigned which, bool directx, int threads,
                           ts_status *st);
ts_code io_write_maps_meta(const char *folder, unsigned which, bool directx, ts_status *st);
/* The lines of meta.txt that io_read_map_folder reads; without metallic files the colours are diffuse and F0. */
void io_print_conventions(FILE *f, unsigned which, bool directx);
/* A five-panel strip as io_read_strip reads it (16-bit PNG); input is linear, size x size. */
ts_code io_write_strip(const char *path, const io_material *m, const io_image *input, ts_status *st);
/* Reads maps.exr back, which only tests do; the maps' normals have y up, whatever the file's have. */
ts_code io_read_maps_exr(const char *path, io_material *m, ts_status *st);
#endif
