/* Image files made byte by byte, for what no ordinary writer writes. */
#ifndef TESTS_MAKE_IMAGES_H
#define TESTS_MAKE_IMAGES_H
#include <stddef.h>
#include <stdint.h>

typedef struct bytes {
    uint8_t *data; /* freed by bytes_save and bytes_free */
    size_t size, capacity;
} bytes;

void put(bytes *b, const void *data, size_t size);
void put8(bytes *b, unsigned v);
void put16(bytes *b, unsigned v); /* big-endian */
void put32(bytes *b, uint32_t v);
void put16le(bytes *b, unsigned v);
void put32le(bytes *b, uint32_t v);
void bytes_free(bytes *b);
/* Writes folder/name and frees the bytes; returns the path, which stays valid until the next but seven calls. */
const char *bytes_save(bytes *b, const char *folder, const char *name);
bytes bytes_load(const char *path);

/* PNG: begin, any chunks, pixels, end. colour: 0 grey, 2 RGB, 3 palette, 4 grey and alpha, 6 RGBA. row: bytes of a row.
 */
void png_begin(bytes *b, uint32_t width, uint32_t height, int depth, int colour);
void png_chunk(bytes *b, const char *type, const void *data, size_t size);
void png_pixels(bytes *b, const void *pixels, size_t row, int rows);
void png_profile(bytes *b, const bytes *profile);
void png_end(bytes *b);

/* An ICC profile of the matrix kind: colorants as D50 XYZ columns red, green, blue; gamma 0: the sRGB curve as
 * parameters; -1: as a table; otherwise a power. */
bytes icc_profile(const double colorants[9], double gamma);
extern const double icc_srgb[9], icc_display_p3[9], icc_adobe_rgb[9];

/* Puts a segment (marker 0xe1 = APP1 ...) behind the first two bytes of a JPEG file. */
void jpeg_insert(bytes *jpeg, int marker, const void *data, size_t size);
void jpeg_orientation(bytes *jpeg, int orientation);
void jpeg_profile(bytes *jpeg, const bytes *profile);
/* A JPEG of one colour, 16 x 8, four components with Adobe's marker: inverted CMYK. Values 0 .. 255 as stored. */
bytes jpeg_cmyk(const uint8_t stored[4]);

/* One page of a little-endian TIFF file after another. format: 1 unsigned, 3 float. extra: -1 none, 0 unspecified, 1
 * associated, 2 straight alpha. */
typedef struct tiff_page {
    int width, height, samples, bits, photometric, format, extra, orientation;
    const void *pixels;
} tiff_page;
bytes tiff_file(const tiff_page *pages, int count);

/* An uncompressed EXR with float channels B G R; chromaticities: eight numbers or NULL. pixels: [height][width][3] red
 * first. */
bytes exr_file(int width, int height, const float *pixels, const float *chromaticities);
/* A row of pixels with channels of such names, which are sorted; pixels: [channels][width]. */
bytes exr_row(int width, int channels, const char *const *names, const float *pixels);
#endif
