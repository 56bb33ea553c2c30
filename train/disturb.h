/* R_0 made worse than g makes it, for h to learn from. */
#ifndef TR_DISTURB_H
#define TR_DISTURB_H
#include <stdint.h>

/* Of the materials that training draws, g has told from a photograph what can be told: what is left of R_0's error is
 * chance, of which the photograph's difference from the rendering says nothing. Of others R_0 is off in ways that this
 * difference shows, and h has to have seen such.
 * maps [side, side, MAP_CHANNELS], encoded, of material number index: for the share of the materials diffuse, relief,
 * roughness and F0 are multiplied by a factor each, and a few materials become a metal, or what was one a dielectric.
 * Nothing is made worse at a place alone: h would learn that a highlight which is brighter or darker than its rendering
 * is a spot in F0. */
void tr_disturb(double share, uint64_t seed, uint64_t index, int side, float *maps);
#endif
