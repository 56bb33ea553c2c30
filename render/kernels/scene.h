/* Rows of a photograph as a function of what is global about its scene, too: render/scene_model.h has the equations. */
#ifndef TS_SCENE_H
#define TS_SCENE_H
#include "render/kernels/posterior.h"
#include "render/kernels/view.h"

/* The derivatives by the numbers of rd_scene_number, in their order, and by the level of the roughness after them. */
enum {
    TS_SCENE_NUMBERS = 8,
    TS_SCENE_UNKNOWNS = TS_SCENE_NUMBERS + 1,
    TS_SCENE_PAIRS = TS_SCENE_UNKNOWNS * (TS_SCENE_UNKNOWNS + 1) / 2
};

typedef struct ts_scene {
    ts_shade_view view; /* TS_SHADE_POSITIONS; light and camera at the same height */
    float offset;       /* patch widths for one number of a place */
    float ambient;      /* radiance for one number of the ambient light */
    float tone;         /* strength of the tone curve */
    bool least;         /* a burnt-out value is ignored where the rendering is above 1; else everywhere */
} ts_scene;

/* Sums over pixels of the normal equations, the upper triangle of the matrix by rows. */
typedef struct ts_scene_sums {
    double matrix[TS_SCENE_PAIRS], right[TS_SCENE_UNKNOWNS];
} ts_scene_sums;

struct ts_scene_kernels {
    /* image[count, 3] = min(value, limit). */
    void (*render)(const ts_scene *scene, const ts_shade_row *row, float limit, float *image);
    /* up[count, 3]: derivatives by the image; none where it is limited. sums[TS_SCENE_NUMBERS]: += their derivatives by
     * the numbers; gradient[count, channels] (may be NULL): by the maps. */
    void (*backward)(const ts_scene *scene, const ts_shade_row *row, float limit, const float *up, double *sums,
                     float *gradient);
    /* Adds J_t' V J_t and J_t' V e, where V = (J Sigma J' + S)^-1, J = d seen / d maps, J_t = d seen / d
     * numbers and level, e = image - seen. */
    void (*normal)(const ts_scene *scene, const ts_shade_row *row, const float *image, const ts_prior *prior,
                   const float *deviation, ts_scene_sums *sums);
};
TS_FAMILY(scene)
#endif
