/* lgd: the material of a flat surface from one flash photograph. The public C API. */
#ifndef LGD_H
#define LGD_H
#include <stddef.h>

#ifdef __cplusplus
extern "C" {
#endif

typedef struct lgd_model lgd_model;

/* One line of text about the last failure of that call; empty after success. */
typedef struct lgd_error {
    int code; /* 0: none */
    char message[512];
} lgd_error;

/* Reads weights (safetensors). NULL and error on failure. The caller frees, when no call uses it. Any number of threads
 * may call lgd_estimate with one model at once: each such call has memory of its own (30 MB at 256 x 256 pixels), which
 * the model keeps for later calls, but for what photographs over 512 pixels a side took. */
lgd_model *lgd_load(const char *weights, lgd_error *error);
void lgd_free(lgd_model **model);

int lgd_trained_iterations(const lgd_model *model); /* the T that the model was trained for */
int lgd_most_photos(const lgd_model *model); /* photographs that it reads at once: 1, or those of a multi-image model */

/* As many steps as the reconstruction RMSE falls by, at least a thousandth each, LGD_AUTO_MOST at most; R_t is that of
 * the last such step. Of photographs that are refined tile by tile the steps are counted on the photograph at 256 x 256
 * pixels. */
enum { LGD_AUTO = -2, LGD_AUTO_MOST = 24 };

/* What costs the least time for renderings that are at most 1% worse than those of all steps, where steps at the
 * photograph's size have a network; where they have none they cost so little that ending them early saves nothing
 * (docs/performance.md). */
#define LGD_TOLERANCE 0.003
#define LGD_ORIENTATIONS_DEFAULT                                                           \
    2 /* as little error in renderings as 8 in a quarter of g's time (docs/performance.md) \
       */
#define LGD_TOLERANCE_DEFAULT (-1.0)

enum { LGD_F32, LGD_BF16 };

typedef struct lgd_options {
    int iterations; /* refinement steps; 0: R_0 alone, -1: as trained, LGD_AUTO */
    int exact; /* 0: 3 x 3 convolutions by Winograd's way where that is faster, with maps that differ by less than 1e-4;
                * else directly, as weights of the published network always are */
    int precision; /* LGD_F32, or LGD_BF16: inputs and weights of convolutions rounded to bf16, multiplied by the CPU's
                    * AMX or AVX512-BF16 or, much slower, from f32; sums, renderer and maps stay f32
                    * (docs/performance.md says how far the maps differ) */
    int orientations; /* 2, 4, 8: the first estimate is the mean of those of so many of the photograph's orientations
                       * (as it is and turned by a quarter, all quarter turns, and their mirror images), where it is the
                       * only one and light and camera are above its centre (not with the published weights); 1 or 0: of
                       * the photograph as it is */
    int threads;      /* that the call computes on; 0: as many as the process may use */
    /* Called after R_0 (step 0) and after every refinement; return nonzero to stop there. May be NULL. rmse: the
     * reconstruction RMSE after R_0, after the last of the iterations and, where they are LGD_AUTO or every_rmse is not
     * 0, which takes a tenth more time, after every other; else NAN. */
    int (*progress)(int step, double rmse, void *user);
    void *user;
    int every_rmse;
    /* side x side, or NULL: only where it is not zero are the maps sure to be refined, exactly as they would be without
     * it; elsewhere they may be those of an earlier step. */
    const unsigned char *mask;
    /* The photograph (over 512 pixels a side: each of its tiles of 256 x 256, with a mask of 128 x 128) is refined no
     * further once the RMS of a step's change of its maps (in their encoding, [-1, 1]), over it and all that it reads,
     * is below this: its maps are then exactly those of that step. 0: never. LGD_TOLERANCE_DEFAULT: LGD_TOLERANCE where
     * a network refines at the photograph's size, iterations is -1, exact 0 and the weights are not the published ones,
     * whose steps couple all pixels; else 0. */
    double tolerance;
    /* Photographs over 512 pixels a side, and those with mask or tolerance, are refined tile by tile, all steps of a
     * tile at a time: progress is then called for every step at the end (stopping at a step does the work again to
     * there), and this before each tile with the fraction that is done; nonzero ends the work with an error. May be
     * NULL. */
    int (*tile)(double done, void *user);
    /* NULL: the photographs' lights are as strong as they say. Else what all of them have to be multiplied by is
     * estimated from the photographs alone (it can be told apart from the albedo only where that would have to be above
     * 1 or outside of what the model knows), taken, and written here; 1 for the published weights, whose light is
     * fixed. */
    double *power;
} lgd_options;
lgd_options lgd_options_default(void);

/* image: side x side x 3 linear values (clamped to [0, 1] here), top row first. maps: side x side x 9, in [0, 1] where
 * not said otherwise: diffuse rgb, normal x and y in [-1, 1] (OpenGL, z = sqrt(1 - x^2 - y^2)), roughness, specular F0
 * rgb. Returns 0, or nonzero with error set and maps unspecified. */
int lgd_estimate(lgd_model *model, const float *image, int side, const lgd_options *options, float *maps,
                 lgd_error *error);

/* A photograph of the sample, rectified to it. Positions in patch widths (the sample is [-1/2, 1/2]^2 at z = 0, x
 * right, y up), both above the sample; radiance = BRDF max(n.l, 0) power / distance^2. */
typedef struct lgd_photo {
    const float *image; /* side x side x 3 linear values (clamped to [0, 1] here), top row first */
    float light[3], camera[3], power;
} lgd_photo;

/* The photograph that lgd_estimate assumes: light and camera at one place above the centre, of the usual power. */
lgd_photo lgd_flash_photo(const float *image);

/* lgd_estimate from 1 .. lgd_most_photos photographs under known lights, in any order. */
int lgd_estimate_photos(lgd_model *model, const lgd_photo *photo, int photos, int side, const lgd_options *options,
                        float *maps, lgd_error *error);

/* Renders maps as returned by lgd_estimate under a point light and a camera (positions in patch widths, the sample is
 * [-1/2, 1/2]^2 at z = 0, y up): image is side x side x 3, linear. */
int lgd_render(const float *maps, int side, const float light[3], const float camera[3], float power, float *image,
               lgd_error *error);

const char *lgd_version(void);

#ifdef __cplusplus
}
#endif
#endif
