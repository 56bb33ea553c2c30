/* How much of a displaced highlight is the sample's own slope. A light at p beside the camera moves the highlight of a
 * flat sample by p / 2; a sample whose normals lean by n moves it by -D n, with D the camera's distance. One
 * photograph does not tell the two apart, and the fit of the scene takes all of it for the light. */
#ifndef NN_LEAN_H
#define NN_LEAN_H
#include "render/scene.h"

/* By the deviations of samples' slopes, NN_LEAN, and of the places of flashes, NN_LEAN_FLASH patch widths, the share
 *     s = LEAN^2 / (LEAN^2 + (FLASH / 2 D)^2)
 * of the light's place p in number (x and y beside the camera) is the sample's: the normals of maps, [pixels,
 * channels], get -s p / 2 D more, each within [-1, 1], and p becomes (1 - s) p. For a light whose place is not known.
 */
#define NN_LEAN 0.04
#define NN_LEAN_FLASH 0.08
void nn_share_lean(int64_t pixels, int channels, int threads, float number[RD_SCENE_NUMBERS], float *maps);
#endif
