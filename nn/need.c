/* What g holds at once, counted as nn/unet.c and nn/detail.c allocate it. */
#include "nn/need.h"
#include "nn/layers.h"
#include "tensor/maps.h"
#include <math.h>

/* A block's values in floats a pixel: what it reads, the two convolutions, the norm and the sum; and its result once
 * more, which moves out of the scope. */
static double block_values(double in, double middle, double out) { return in + middle + 4 * out; }

static double unet_floats(const nn_arch *a)
{
    const double pixels = (double)a->g_size * a->g_size, w0 = nn_level_width(a, 0), reads = nn_g_reads(a);
    /* what is read: the photographs side by side, as squares, with coordinates and conditions, each a copy */
    double held = pixels * (reads + (a->g_unshuffle > 1 ? 2 * reads : 0) + (a->conditions ? reads : 0) + w0),
           most = held;
    for (int i = 0; i < a->g_levels; i++) {
        const double here = pixels / exp2(2 * (i + 1)), in = nn_level_width(a, i), out = nn_level_width(a, i + 1);
        most = fmax(most, held + here * block_values(in, out, out));
        held += here * out;
    }
    double deep = nn_level_width(a, a->g_levels);
    for (int i = a->g_levels - 1; i >= 0; i--) {
        const double here = pixels / exp2(2 * i), skip = nn_level_width(a, i), in = skip + deep,
                     out = i > 0 ? nn_level_width(a, i - 1) : w0;
        most = fmax(most, held + here * block_values(deep + in, in / 2, out));
        held += here * out;
        deep = out;
    }
    held += pixels * 4 * a->channels;
    return fmax(most, held);
}

/* Of one image in nn_squares, beside the result. */
static double squares_floats(const nn_arch *a)
{
    const double pixels = (double)a->g_size * a->g_size;
    return pixels * (2 * a->g_detail + nn_level_width(a, 0));
}

/* Of one image at the full size: bands, then the coarse maps' resampling. */
static double full_floats(const nn_arch *a)
{
    const double side = nn_arch_side(a), writes = nn_detail_writes(a), constants = 3 + NN_COORDINATES,
                 rows = fmin(NN_BAND + 2 * nn_band_margin(a), a->g_size) / a->g_size,
                 reading = (3 * a->g_half + 2 * NN_HALF_READS) / 4.0, changing = 3 * a->g_half / 4.0 + NN_FINE,
                 half = a->g_half > 0 ? NN_FINE + fmax(reading, changing) : 0,
                 last = 2 * constants + NN_FINER + writes + a->channels + NN_FRAME,
                 band = rows * (NN_FINE + fmax(fmax(NN_FINE, half), last));
    return side * side * (NN_COORDINATES + fmax(band, a->channels));
}

/* The means over the tellings, of one image. */
static double means_floats(const nn_arch *a)
{
    const double pixels = (double)a->g_size * a->g_size;
    return pixels * (nn_g_reads(a) + nn_level_width(a, 0) + a->channels);
}

double nn_guess_bytes(const nn_arch *a, int orientations, int tellings)
{
    const double side = nn_arch_side(a), pixels = (double)a->g_size * a->g_size, photo = 3.0 * a->images,
                 maps = a->channels + (a->spread ? NN_SPREADS : 0);
    const bool turned = orientations > 1 && a->compat == NN_COMPAT_NONE, detail = a->g_unshuffle > 1;
    const int images = turned ? orientations : 1;
    /* the photographs at g's size and encoded; of several orientations their maps' mean */
    const double once = side * side * (3 * photo + (turned ? 2 * maps : 0)),
                 left = detail ? pixels * (a->g_detail + a->channels) : 0; /* of the U-Net */
    const double means = tellings > 1 ? means_floats(a) : 0,
                 unet = images * (tellings * unet_floats(a) + means + (detail ? squares_floats(a) : 0)),
                 full = detail ? full_floats(a) + images * side * side * maps : 0;
    return (once + images * (side * side * photo + left) + fmax(unet, full)) * sizeof(float);
}
