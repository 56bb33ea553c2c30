/* What is left wrong with photographs of a printed sheet once their windows, cameras and exposures are known
 * (data/rectify/sheet_set.h). Each is drawn from (seed, index) alone; one that is 0 changes no byte. */
#ifndef IO_UNDER_SHEET_H
#define IO_UNDER_SHEET_H
#include "data/camera.h"

typedef struct io_under_sheet {
    float pose;    /* camera and flash are each at most this far from where they are thought to be, patch widths */
    float shift;   /* the window is at most this far beside its place, and again as far bent; pixels of 512 a side */
    float bracket; /* photographs are up to this share brighter or darker than they should be */
} io_under_sheet;

/* Moves camera and light of what is thought to where they are. */
void io_under_sheet_move(const io_under_sheet *u, uint64_t seed, uint64_t index, io_rig *rig);

/* Resamples a linear rendering [size][size][3], in place: beside its place, and bent as a lens's radial distortion of
 * the third order bends it, by u->shift at the middle of an edge. */
void io_under_sheet_shift(const io_under_sheet *u, uint64_t seed, uint64_t index, int size, float *image);

/* The factor on radiance in the model's brightness that gives a photograph's linear value: the paper is at 0.6 of what
 * clips, give or take u->bracket. */
float io_under_sheet_exposure(const io_under_sheet *u, uint64_t seed, uint64_t index);
#endif
