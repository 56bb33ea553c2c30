/* What is to be written of a photograph, and what came of it. */
#ifndef LGD_ORDER_H
#define LGD_ORDER_H
#include "data/metallic.h"
#include <stdbool.h>

/* What can be written for a photograph, a bit each in the order of lgd_output_names. */
enum {
    LGD_OUT_DIFFUSE = 1 << 0,   /* diffuse.png, sRGB */
    LGD_OUT_SPECULAR = 1 << 1,  /* specular.png: F0, sRGB */
    LGD_OUT_ROUGHNESS = 1 << 2, /* roughness.png, linear, 16 bit */
    LGD_OUT_NORMAL = 1 << 3,    /* normal.png, linear, 16 bit */
    LGD_OUT_EXR = 1 << 4,       /* maps.exr */
    LGD_OUT_RENDER = 1 << 5,    /* render.png: the photograph beside the re-rendered flash picture */
    LGD_OUT_PREVIEW = 1 << 6,   /* preview.png: under lights of its own (infer/preview.h) */
    LGD_OUT_BASECOLOR = 1 << 7, /* basecolor.png, sRGB (data/metallic.h) */
    LGD_OUT_METALLIC = 1 << 8,  /* metallic.png, linear, 16 bit */
    LGD_OUT_HEIGHT =
        1 << 9,             /* height.png, 16 bit: the whole range of heights (data/height.h); meta.txt has the scale */
    LGD_OUT_GLTF = 1 << 10, /* material.gltf (infer/export.h) */
    LGD_OUT_MATERIALX = 1 << 11, /* material.mtlx */
    LGD_OUT_GLB = 1 << 12,       /* material.glb: the same as one file */
    LGD_OUT_ORM = 1 << 13,       /* orm.png, linear, 16 bit: occlusion, roughness, metalness */
    LGD_OUT_AO = 1 << 14,        /* occlusion.png, linear, 8 bit (data/occlusion.h) */
    LGD_OUT_PAGE = 1 << 15       /* view.html: a page that lights the material (infer/page.h) */
};
enum { LGD_OUTPUTS = 16, LGD_FILES = LGD_OUTPUTS + 1 };
#define LGD_OUT_DEFAULT 0x7fu
extern const char *const lgd_output_names[LGD_OUTPUTS];
extern const char *const lgd_files[LGD_FILES]; /* the file of each, then meta.txt */

/* A list such as "normal,height" as bits. TS_INVALID names the word. */
ts_code lgd_output_parse(const char *list, unsigned *which, ts_status *st);
enum { LGD_HALF_ABOVE = 512 }; /* pixels a side, by default: as floats a maps.exr of 1024 x 1024 has 54 MB */
/* The maps that glTF and MaterialX documents refer to: of the metallic workflow base colour and orm.png. */
unsigned lgd_output_referred(bool metallic);
/* The same as which in the workflow, with the maps that its documents refer to. */
unsigned lgd_output_complete(unsigned which, bool metallic);

typedef struct lgd_order {
    unsigned which;       /* bits */
    bool directx;         /* normals with y down */
    bool metallic;        /* what documents and material.glb refer to */
    bool half;            /* maps.exr */
    bool repeats;         /* the maps are made seamless (data/seamless.h) */
    int threads;          /* that files are made on */
    const char *fov_from; /* where photo's field of view is known from, for meta.txt */
    double ambient;       /* light of the photograph that is not the flash's (lgd_options.ambient) */
    const char *record;   /* lines more for meta.txt, or NULL */
} lgd_order;

/* TS_INVALID for what does not go together. */
ts_code lgd_order_check(const lgd_order *order, ts_status *st);

typedef struct lgd_output_result {
    float low, high;        /* the heights that 0 and 1 of height.png are, in sides of the square */
    io_metallic_error lost; /* what base colour and metalness cannot express, where they are written */
    unsigned removed;       /* files of another estimate that were removed: a bit each in the order of lgd_files */
} lgd_output_result;
#endif
