/* Coarse steps of the whole photograph, then its tiles: each runs all its steps with as much of its surroundings as its
 * last step can depend on, so its result is that of the whole photograph's refinement, and no more memory is taken than
 * for one tile. A photograph may be one tile. */
#ifndef LGD_TILES_H
#define LGD_TILES_H
#include "nn/model.h"

typedef struct lgd_tiles {
    const float *const *image;  /* [given] of [side][side][3], linear; clamped to [0, 1] on the way */
    const rd_view *views;       /* [given] */
    const unsigned char *known; /* [given] of nn_known, what of views is true; NULL: all of it */
    int given;                  /* photographs, 1 .. nn_most_photographs */
    const unsigned char *mask;  /* [side][side] or NULL: tiles without a nonzero pixel keep what the coarse steps left
                                   (R_0), and of the others only the area that holds such is sure to be refined */
    int side, tile, steps;      /* tile: pixels of a tile's side */
    int orientations;           /* as in nn_input */
    const float *r0;            /* as in nn_input */
    /* NN_DESCENT_POSTERIOR: the standard deviations of R_0's errors, [side][side][NN_SPREADS] of nn_arch_side; else
     * NULL. */
    const float *deviation;
    /* A tile ends at R_t when the RMS of R_t - R_{t-1} over it and what it reads is below; 0: never. */
    double tolerance;
    /* Called before each of several tiles with the part that is done; nonzero: TS_INTERRUPTED. May be NULL. */
    int (*before)(double done, void *user);
    /* Called after R_0 and every step; false: stop there. May be NULL. rmse: R_t's, NAN where it is not measured. maps:
     * R_t as lgd_tiles_run leaves it. Of several tiles it is called when all are done, with the maps of R_steps alone
     * and NULL before; a stop then does the work again. */
    bool (*after)(int step, double rmse, const float *maps, void *user);
    void *user;
    bool ends_alone; /* rmse and maps of R_0 and R_steps alone, which saves resampling and rendering */
    double *rmse;    /* NULL: not measured; or [steps + 1]: reconstruction RMSE at R_t of what is refined (tiles that
                        ended earlier: their last maps), NAN where it is not measured */
    int64_t refined; /* out: pixels times steps that were refined, surroundings not counted */
} lgd_tiles;

/* Whether the result is the untiled one: the published loss couples all pixels at every step, ours does not. */
bool lgd_tiles_exact(const nn_arch *arch);

/* maps: [side][side][channels of the model], R_T in the encoding of tensor/maps.h. The tape has no gradients;
 * everything is allocated from its arena and given back. */
ts_code lgd_tiles_run(ag_tape *tape, const nn_model *model, lgd_tiles *t, float *maps, ts_status *st);
#endif
