/* A camera's faults, added to a clean rendering. Each is drawn from (seed, index) alone; one that is 0 changes no byte.
 */
#ifndef IO_CAMERA_H
#define IO_CAMERA_H
#include <stdbool.h>
#include <stdint.h>

typedef struct io_camera {
    float noise;        /* largest sensor noise, 0 none .. 1 a phone at night: read and shot noise together */
    float noise_spread; /* read and shot noise each have a factor of their own, up to this many stops up or down */
    float blur;         /* largest sigma in pixels at 256^2 */
    bool quantise;      /* 8 bits sRGB, as a file has */
    float exposure;     /* up to this many stops brighter or darker */
    float
        vignette; /* largest share of the light lost in the corners, with the square of the distance from the centre */
    float white_balance; /* red and blue are each up to this share stronger or weaker */
    int jpeg;            /* lowest JPEG quality (to 98), in half of the photographs with halved chroma; 0: none */
    float tilt;          /* largest angle of the axis with the normal, degrees */
    float off_centre;    /* farthest that the axis meets the patch from its centre, patch widths */
} io_camera;

/* Where camera and light stand, in patch widths: (0, 0, distance) turned by the tilt about the point where the axis
 * meets the patch. The photograph is thought of as resampled to the frontal square, so that its maps stay registered:
 * render from there, nothing else changes. */
void io_camera_place(const io_camera *c, uint64_t seed, uint64_t index, float distance, float position[3]);

/* The factor of the light that the exposure stands for, which io_camera_apply multiplies in: for a loss that is to know
 * it. */
float io_camera_exposure(const io_camera *c, uint64_t seed, uint64_t index);

/* image: a linear rendering that is NOT clamped, [size][size][3], in place. In this order: exposure, vignette and white
 * balance; highlights clip at 1; blur; noise; JPEG or rounding to 8 bits. The result lies in [0, 1]. Serial, thread
 * safe. */
void io_camera_apply(const io_camera *c, uint64_t seed, uint64_t index, int size, float *image);

/* What a baseline JPEG of this quality (1 .. 100, the tables of ITU-T T.81 annex K scaled as the Independent JPEG
 * Group's library does) makes of 8-bit sRGB codes [size][size][3], in place. halved: chroma at half the resolution both
 * ways (4:2:0), else at the full (4:4:4). */
void io_jpeg_codes(int size, int quality, bool halved, uint8_t *codes);
#endif
