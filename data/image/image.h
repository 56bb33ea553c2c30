/* Images in memory and in files. Floats, [height, width, channels], channels 1, 3 or 4, top row first. */
#ifndef IO_IMAGE_H
#define IO_IMAGE_H
#include "data/image/lens.h"
#include "tensor/status.h"
#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#define IO_LARGE 64e6 /* bytes of pictures from which on it is asked whether there is memory (tensor/budget.h) */

typedef struct io_image {
    int width, height, channels;
    float *data; /* owned; freed by io_image_free */
} io_image;

ts_code io_image_create(io_image *image, int width, int height, int channels, ts_status *st); /* zeros */
void io_image_free(io_image *image); /* and zeroes the struct */

#define IO_MAX_PIXELS_DEFAULT (1 << 28)

/* A photograph: any format that OpenImageIO reads, turned upright by its EXIF orientation, alpha dropped (composited on
 * black), grey spread to three channels, CMYK and other colour models converted, colour space honoured (sRGB by default
 * for integer formats, Display-P3 and Adobe RGB by their profile, linear for float formats), to LINEAR sRGB primaries.
 * Negative and NaN become 0; values over 1 stay. The size is checked against max_pixels before memory is taken. The
 * programs read squares and rows of it; tests compare those with this. */
ts_code io_read_photo(const char *path, int64_t max_pixels, io_image *image, ts_status *st);

/* What is known of a photograph beside its pixels. */
typedef struct io_photo_facts {
    int width, height; /* of the whole, upright */
    io_lens lens;
    char profile[96]; /* the name of a colour profile that cannot be used: sRGB is assumed; empty: there is none */
    bool transparent; /* somewhere, where it is taken as black */
} io_photo_facts;

/* Its largest centred square as io_centre_square has it, the same values, with memory for a few of the photograph's
 * rows as floats alone. threads: that it is resampled on; 0: the process's number. facts may be NULL. */
ts_code io_read_photo_square(const char *path, int64_t max_pixels, int size, int threads, io_image *square,
                             io_photo_facts *facts, ts_status *st);

/* A photograph with its values as stored, integers / their maximum: upright, three channels, alpha ignored, no colour
 * transform. Float formats, which are linear, are raised to 1 / gamma, so that all come in one encoding. facts may be
 * NULL. */
ts_code io_read_stored(const char *path, int64_t max_pixels, double gamma, io_image *image, io_photo_facts *facts,
                       ts_status *st);

/* A data image (a map): values as stored, integers / their maximum, no colour transform, orientation ignored. channels:
 * 1 or 3 forced. Of one channel NaN and negative become 0 and infinity 65504; of three they stay, for a normal of them
 * is none. */
ts_code io_read_data(const char *path, int channels, int64_t max_pixels, io_image *image, ts_status *st);

/* The same of a mask, one channel: upright, as the photograph that it belongs to. */
ts_code io_read_mask(const char *path, int64_t max_pixels, io_image *image, ts_status *st);

/* The largest centred square, resampled to size x size by an antialiased filter in linear light (ts_resize: no
 * ringing). in may have any number of channels; out is created, also where size is the square's own.
 * threads: 0 is the process's number. */
ts_code io_centre_square(const io_image *in, int size, int threads, io_image *out, ts_status *st);

/* The same by the filter of scikit-image's transform.resize (0.20 to 0.26) with its defaults (order 1, mode "reflect",
 * anti-aliasing where it shrinks): a Gaussian of sigma (in / size - 1) / 2 cut off at 4 sigma, then linear
 * interpolation at (j + 1/2) in / size - 1/2, both axes mirrored about the outermost pixels' centres. */
ts_code io_centre_square_scikit(const io_image *in, int size, int threads, io_image *out, ts_status *st);

/* PNG, bits 8 or 16; srgb: encode linear values by the sRGB curve and tag the file so. Values are clamped to [0, 1],
 * NaN becomes 0; a fourth channel is straight alpha and never encoded. Written to a temporary file in the same folder,
 * synced and renamed; an existing device or pipe is written to directly, a symbolic link is followed. */
ts_code io_write_png(const char *path, const io_image *image, int bits, bool srgb, ts_status *st);
/* The same for a picture whose rows are made when they are written: make fills [count][width][channels] values of the
 * rows from y on, in order, and ends the writing by returning something else than TS_OK (with st). channels: 1 grey, 2
 * with alpha, 3 RGB, 4 with alpha. */
typedef struct io_rows {
    int width, height, channels;
    ts_code (*make)(int y, int count, float *values, void *user, ts_status *st);
    void *user;
} io_rows;
ts_code io_write_png_rows(const char *path, const io_rows *rows, int bits, bool srgb, ts_status *st);
/* The bytes of the file, malloced and the caller's, instead. */
ts_code io_png_bytes(const io_image *image, int bits, bool srgb, unsigned char **bytes, size_t *size, ts_status *st);
ts_code io_write_jpeg(const char *path, const io_image *image, int quality, ts_status *st); /* linear in, sRGB out */

/* sRGB curve (IEC 61966-2-1), the only place that has it. */
float io_srgb_to_linear(float v);
float io_linear_to_srgb(float v);
#endif
