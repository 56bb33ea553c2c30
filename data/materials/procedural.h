/* Procedural SVBRDFs, streamed by (seed, index): the same bytes for any thread count, in any order, from gcc as from
 * clang (plain IEEE arithmetic:
 * -ffp-contract=off, no -ffast-math), as long as the C library's expf, logf, atan2f and so on are the same: another
 * version of it, or another CPU, for which it may choose other code, may round them differently. */
#ifndef IO_PROCEDURAL_H
#define IO_PROCEDURAL_H
#include "data/collection.h"
#include "data/material.h"

/* The families, each a key that can be turned off. io_family_name(i) for i in 0 .. io_family_count()-1. */
int io_family_count(void);
const char *io_family_name(int family);
int io_family_find(const char *name); /* -1: none */
/* Bits of the families that a word names: a family's name, "all", or "classic", the first seventeen, whose materials
 * stay the same as others are added. 0: none. */
uint64_t io_family_mask(const char *name);

typedef struct io_procedural {
    uint64_t seed;
    uint64_t families; /* bit i: family i may be drawn; 0 = all */
    uint64_t often;    /* families that are drawn three times as often as the rest; 0 = none */
    float hues;        /* share of the materials that get other hues (materials/hues.h); the rest stay as they are */
    float darker;      /* share of those whose diffuse colours are darkened (materials/darker.h) */
    float relief;      /* share of those whose relief is made anew (materials/relief.h) */
    float blend;       /* share of those that are a mean of themselves and another (materials/blend.h) */
    float uneven;      /* share of those that lean and undulate (materials/uneven.h) */
    float closer;      /* share of those of which only a part is seen, from a quarter of the patch's side on */
    float homogeneous; /* share of those that are the same all over the patch (materials/homogeneous.h) */
    float smoother;    /* share of those with a smoother surface (materials/smoother.h) */
    float steeper;     /* share of those with a steeper relief (materials/steeper.h) */
    float plain;       /* share of those of one gloss, with hardly any relief (materials/plain.h) */
    const io_collection *collection; /* not owned; map sets of which materials are parts (materials/collected.h) */
    float collected; /* share of the materials that are, in place of a family's or two; 0 where there are none */
} io_procedural;

/* Material number index. m->size and m->maps are the caller's (io_material_create). Serial, thread safe. */
void io_procedural_make(const io_procedural *p, uint64_t index, io_material *m);
#endif
