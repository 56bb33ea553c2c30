/* A part of a map set as a material. */
#ifndef CV_COLLECTED_H
#define CV_COLLECTED_H
#include "data/collection.h"
#include "data/materials/canvas.h"

/* Fills all that is painted with a part of the set (io_collection_get): two fifths of its side to all of it, from any
 * place, turned (by quarter turns, or in three of ten at any angle) and mirrored. In half of them the levels of
 * roughness and of a dielectric's F0 are drawn anew: how glossy a material is, its picture rarely says. Draws from
 * c->rng. */
void cv_collected(io_canvas *c, const io_collected *set);
#endif
