/* The channels of a material's maps, everywhere in this order: [N, H, W, 9], linear, each meant to lie in [-1, 1].
 * diffuse albedo, roughness and specular F0 are stored as 2 v - 1; the normal's x (right) and y (up) as they are,
 * n_z = sqrt(1 - x^2 - y^2) >= 0. A published network's tenth channel (light intensity) follows these nine. */
#ifndef TS_MAPS_H
#define TS_MAPS_H
#include <math.h>

enum {
    MAP_DIFFUSE = 0,   /* 3 channels: red, green, blue */
    MAP_NORMAL = 3,    /* 2 channels: x, y */
    MAP_ROUGHNESS = 5, /* 1 channel: perceptual roughness, alpha = roughness^2 */
    MAP_SPECULAR = 6,  /* 3 channels: F0 red, green, blue */
    MAP_CHANNELS = 9
};
/* The four maps that these channels are, for what is said of each as a whole. */
enum { GROUP_DIFFUSE, GROUP_NORMAL, GROUP_ROUGHNESS, GROUP_SPECULAR, MAP_GROUPS };

/* An albedo, F0 or roughness, clamped to [0, 1], as it is stored. */
static inline float map_stored(float v) { return 2 * fminf(fmaxf(v, 0), 1) - 1; }
#endif
