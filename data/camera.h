/* A camera's faults, added to a clean rendering. Each is drawn from (seed, index) alone; one that is 0 changes no byte.
 */
#ifndef IO_CAMERA_H
#define IO_CAMERA_H
#include "data/develop.h"
#include <stdbool.h>
#include <stdint.h>

typedef struct io_camera {
    float noise;         /* largest sensor noise, 0 none .. 1 a phone at night: read and shot noise together */
    float noise_spread;  /* read and shot noise each have a factor of their own, up to this many stops up or down */
    float blur;          /* largest sigma in pixels at 256^2 */
    bool quantise;       /* 8 bits sRGB, as a file has */
    float exposure;      /* up to this many stops brighter or darker */
    float meter;         /* most that the mean of the clamped picture may be, by less exposure; 0: not metered */
    float automatic;     /* share of the photographs whose exposure the camera chose */
    float vignette;      /* largest share of the light lost in the corners, with the squared distance from the centre */
    float white_balance; /* red and blue are each up to this share stronger or weaker */
    int jpeg;            /* lowest JPEG quality (to 98), in half of the photographs with halved chroma; 0: none */
    float tilt;          /* largest angle of the axis with the normal, degrees */
    float off_centre;    /* farthest that the axis meets the patch from its centre, patch widths */
    float fov_min, fov_max;      /* field of view across the square, degrees; both 0: the distance that is given */
    float flash;                 /* largest offset of the light from the camera parallel to the sample, patch widths */
    float flash_size;            /* largest radius of the flash's disk, as a share of its distance */
    float glare;                 /* largest share of the light that the lens scatters */
    float lobes;                 /* largest share of the mirrored light that a broader lobe takes */
    float soften;                /* largest share of the relief that diffuse shading does not show */
    float ambient;               /* largest other light, as a share of the flash's at the centre of a matt sample */
    float tone;                  /* largest strength of the tone curve; half of the photographs roll off highlights */
    float sharpen;               /* largest amount of the unsharp mask */
    float told_view, told_power; /* share of the photographs whose field of view or power a model is given */
} io_camera;

/* Where camera and light stand, in patch widths, and the light's power. */
typedef struct io_rig {
    float camera[3], light[3], power;
} io_rig;

/* From the rig that is planned, its camera straight above the centre, to the one of this photograph. The field of view
 * gives the distance 0.5 / tan(fov / 2), uniform in its logarithm; the power grows with its square, as of a phone that
 * exposes for the sample. The camera is turned by the tilt about the point where the axis meets the patch, and the
 * light goes with it; then the light moves aside. The photograph is thought of as resampled to the frontal square, so
 * that its maps stay registered: render from there, nothing else changes. */
void io_camera_rig(const io_camera *c, uint64_t seed, uint64_t index, io_rig *rig);

/* Weak light beside the flash, in shares of the flash's radiance at the centre of a flat matt sample: one part from
 * everywhere, one from far away in a direction. Whoever renders adds it before io_camera_apply. */
typedef struct io_ambient {
    float share; /* of both together, in green */
    float uniform[3], side[3], direction[3];
} io_ambient;
io_ambient io_camera_ambient(const io_camera *c, uint64_t seed, uint64_t index);

/* The flash is a disk parallel to the sample: the square of its radius, as a share of its distance, is uniform. */
typedef struct io_disk {
    float radius, turn; /* patch widths at this distance; radians: of whatever pattern its points have */
} io_disk;
io_disk io_camera_flash(const io_camera *c, uint64_t seed, uint64_t index, float distance);

/* How the sample reflects otherwise than the renderer's BRDF, as real ones do. The mirrored light has two lobes, share
 * of it that of roughness r broad, the rest that of r narrow: broad^share narrow^(1 - share) = 1, so that the mean of
 * their logarithms is r's. The diffuse light comes out of the material beside where it went in: it is shaded by
 * normals of which n_x and n_y are soft times as long. 0, 1, 1, 1 with both keys at 0. */
typedef struct io_reflection {
    float share, broad, narrow, soft;
} io_reflection;
io_reflection io_camera_reflection(const io_camera *c, uint64_t seed, uint64_t index);

/* The tone curve and the shoulder that io_camera_apply puts in. */
io_tone io_camera_tone(const io_camera *c, uint64_t seed, uint64_t index);

/* Whether a model is given this photograph's field of view, and its power. */
void io_camera_told(const io_camera *c, uint64_t seed, uint64_t index, bool *view, bool *power);

/* The factor of the light that the exposure stands for, which io_camera_apply multiplies in: for a loss that is to know
 * it. */
float io_camera_exposure(const io_camera *c, uint64_t seed, uint64_t index);

/* The factor on an unclamped linear rendering [size][size][3] by which the camera's own choice changes what
 * io_camera_apply would expose and clamp. In c->automatic of the photographs it takes the place of the drawn exposure:
 * it brings the mean to .15, up to 1.2 stops more or less, but burns out at most 3% of the values: a phone aims at a
 * middle grey, of dark leather too, and spares highlights. Elsewhere it is at most 1 and brings the mean to at most
 * c->meter: a phone's metering spares the photographer a white picture. */
float io_camera_meter(const io_camera *c, uint64_t seed, uint64_t index, int size, const float *image);

/* image: a linear rendering that is NOT clamped, [size][size][3], in place. In this order: glare; exposure, vignette
 * and white balance; highlights roll off or clip at 1; blur; noise; tone curve; sharpening; JPEG or rounding to 8 bits.
 * The result lies in [0, 1]. Serial, thread safe. */
void io_camera_apply(const io_camera *c, uint64_t seed, uint64_t index, int size, float *image);

/* What a baseline JPEG of this quality (1 .. 100, the tables of ITU-T T.81 annex K scaled as the Independent JPEG
 * Group's library does) makes of 8-bit sRGB codes [size][size][3], in place. halved: chroma at half the resolution both
 * ways (4:2:0), else at the full (4:4:4). */
void io_jpeg_codes(int size, int quality, bool halved, uint8_t *codes);
#endif
