/* What the kernels shade: a row of pixels under a view, with the renderer's guards. */
#ifndef TS_VIEW_H
#define TS_VIEW_H
#include <stdbool.h>

/* Roughness to GGX's width, for doubles and vectors. */
#define TS_ALPHA(roughness) ((roughness) * (roughness))

typedef struct ts_shade_guards {
    double roughness;                /* smallest roughness */
    double nz2;                      /* smallest n_z^2 before normalisation */
    double distance2;                /* smallest squared distance in the falloff */
    double lz;                       /* smallest l_z that irradiance is divided by */
    double distribution, k, cosines; /* TS_SHADE_PUBLISHED: added to pi (…)^2 below D, to G's k, and to 4 n.l n.v;
                                        elsewhere 0 and ignored */
} ts_shade_guards;

typedef enum ts_shade_kind {
    TS_SHADE_POSITIONS,
    TS_SHADE_COLLOCATED, /* the light's position is the camera's: l = v = h */
    TS_SHADE_DIRECTIONS, /* unit l, v and h are the same for every pixel */
    TS_SHADE_PUBLISHED   /* collocated, with the published renderer's guards (render/published.h) */
} ts_shade_kind;

typedef struct ts_shade_view {
    const ts_shade_guards *guards;
    ts_shade_kind kind;
    bool falloff; /* the light's strength is power / |light - x|^2; else power / max(l_z, guards->lz) */
    double light[3], camera[3], half[3]; /* half: TS_SHADE_DIRECTIONS only */
    float power;                         /* TS_SHADE_DIRECTIONS: the strength itself */
    float ambient;                       /* of uniform surroundings (rd_view) */
    float fresnel; /* 2^(...), where v.h is the same for every pixel: not for TS_SHADE_POSITIONS */
} ts_shade_view;

/* A light that is a disk, as points about its centre, TS_DISK_FEW of them and TS_DISK_MANY. Where alpha is above
 * as_one a rendering does not tell it from its centre, above as_few it takes few points. */
enum { TS_DISK_FEW = 8, TS_DISK_MANY = 32 };
typedef struct ts_shade_disk {
    double few[TS_DISK_FEW][2], many[TS_DISK_MANY][2];
    float as_one, as_few;
} ts_shade_disk;

/* count pixels, pixel i with its centre at ((column + i + 1/2) step - 1/2, y); maps [count, channels], channels >= 9. A
 * pixel's result does not depend on the row that it is computed in. */
typedef struct ts_shade_row {
    double y, step;
    int column, count, channels;
    const float *maps;
} ts_shade_row;
#endif
