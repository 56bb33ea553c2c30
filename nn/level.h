/* The levels of a material, of one photograph whose light and camera are known. What g says of F0, roughness and
 * diffuse is right in shape more often than in level: materials between metal and dielectric most of all, which it
 * reads as one of both. Steps take each pixel alone and believe little of what one pixel says of F0; a level is what
 * all of them say together. */
#ifndef NN_LEVEL_H
#define NN_LEVEL_H
#include "nn/kind.h"
#include "nn/trial.h"

/* Factors on maps of the whole sample: F0, roughness and diffuse times e to these; so much of F0 (as it was) more
 * diffuse, which a metal that is none lacks, beneath >= 0; and red and blue of diffuse and of F0 times e to these. */
enum {
    NN_LEVEL_DIFFUSE,
    NN_LEVEL_F0,
    NN_LEVEL_ROUGHNESS,
    NN_LEVEL_BENEATH,
    NN_LEVEL_DIFFUSE_RED,
    NN_LEVEL_DIFFUSE_BLUE,
    NN_LEVEL_F0_RED,
    NN_LEVEL_F0_BLUE,
    NN_LEVELS
};

/* What the square of a level over its standard deviation (nn/level.c) costs beside the misfit (nn/trial.h). */
#define NN_LEVEL_COST 0.02
/* Pixels a side that are tried; steps of each trial. */
#define NN_LEVEL_SIDE 32
#define NN_LEVEL_STEPS 4
/* What part of the sum of misfit and cost is left where the levels are believed whole, and not at all: what takes less
 * off is not to be told from what is wrong in each pixel. Between both they are believed in part, so that no rounding
 * and no shade of the photograph makes all maps jump. */
#define NN_LEVEL_SURE 0.8
#define NN_LEVEL_DOUBTFUL 0.9

/* The maps r0 [grid.side][grid.side][channels] become those of the levels with the least sum, by a search along each of
 * them in turn, as far as they are believed. image [side][side][3], linear, taken under
 * view with light and camera as known; kind: what the sample is known to be, a metal's diffuse and a dielectric's F0
 * stay as they are; deviation [grid.side][grid.side][NN_SPREADS] as the steps believe it. The same bytes for any number
 * of threads. Fails where memory is out; r0 is then as it was. */
ts_code nn_find_levels(rd_grid grid, const float *image, int side, const rd_view *view, nn_kind kind,
                       const float *deviation, int channels, float *r0, ts_status *st);

/* maps [pixels][channels] with these levels; each value ends in [-1, 1]. */
void nn_set_levels(int64_t pixels, int channels, const float level[NN_LEVELS], float *maps);
#endif
