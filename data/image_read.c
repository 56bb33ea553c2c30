#include "data/colour.h"
#include "data/common_read.h"
#include "data/file.h"
#include "data/image.h"
#include "data/image_read.h"
#include "data/oiio.h"
#include "data/png_file.h"
#include <math.h>
#include <stdlib.h>

static io_space space_of(const char *path, const oi_image *image)
{
    io_space space;
    if (io_space_png(path, &space)) return space;
    if (io_space_icc(image->icc, image->icc_size, &space)) return space;
    if (image->primaries && io_space_primaries(image->chromaticities, image->floating ? 1 : 0, &space)) return space;
    if (image->floating || image->linear) return io_space_linear();
    return image->adobe ? io_space_adobe_rgb() : io_space_srgb();
}

/* Integers have few different values: the curve is evaluated once for each. */
static bool build_tables(const io_space *space, int levels, float **tables)
{
    *tables = malloc(3 * (size_t)levels * sizeof(float));
    if (!*tables) return false;
    for (int c = 0; c < 3; c++)
        for (int i = 0; i < levels; i++) (*tables)[c * levels + i] = io_curve_value(&space->curve[c], (float)i / (float)(levels - 1));
    return true;
}

static float lookup(const float *table, int levels, float v)
{
    int i = v > 0 ? (int)(v * (float)(levels - 1) + 0.5f) : 0;
    return table[i < levels ? i : levels - 1];
}

static void convert_pixel(const oi_image *raw, const io_space *space, const float *tables, const float *in, float *out)
{
    for (int c = 0; c < 3; c++) {
        float v = in[raw->colour[c]];
        out[c] = tables ? lookup(tables + c * raw->levels, raw->levels, v) : io_curve_value(&space->curve[c], v);
    }
    if (raw->alpha >= 0 && !raw->associated)
        for (int c = 0; c < 3; c++) out[c] *= in[raw->alpha]; /* over black, in linear light */
    io_space_matrix(space, out);
}

/* Where the pixel at column x, row y of the upright image lies in the stored one of w x h pixels (Exif 2.3, 4.6.4 A, Orientation). */
static size_t stored_at(int orientation, int x, int y, int w, int h)
{
    int column = x, row = y;
    switch (orientation) {
    case 2: column = w - 1 - x; break;
    case 3: column = w - 1 - x, row = h - 1 - y; break;
    case 4: row = h - 1 - y; break;
    case 5: column = y, row = x; break;
    case 6: column = y, row = h - 1 - x; break;
    case 7: column = w - 1 - y, row = h - 1 - x; break;
    case 8: column = w - 1 - y, row = x; break;
    default: break;
    }
    return (size_t)row * (size_t)w + (size_t)column;
}

static ts_code convert(const char *path, const oi_image *raw, bool upright, io_image *image, ts_status *st)
{
    io_space space = space_of(path, raw);
    int orientation = upright ? raw->orientation : 1;
    bool swap = orientation >= 5;
    float *tables = NULL;
    if (!raw->floating && !build_tables(&space, raw->levels, &tables)) return ts_fail(st, TS_NOMEM, "%s: out of memory", path);
    ts_code code = io_image_create(image, swap ? raw->height : raw->width, swap ? raw->width : raw->height, 3, st);
    float *out = image->data;
    for (int y = 0; code == TS_OK && y < image->height; y++)
        for (int x = 0; x < image->width; x++, out += 3)
            convert_pixel(raw, &space, tables, raw->data + stored_at(orientation, x, y, raw->width, raw->height) * (size_t)raw->channels, out);
    free(tables);
    return code == TS_OK ? code : ts_context(st, "%s", path);
}

static ts_code read_raw(const char *path, int64_t max_pixels, oi_image *raw, ts_status *st)
{
    ts_code code = io_check_file(path, st);
    if (code == TS_OK) code = io_check_png(path, st);
    if (code != TS_OK || io_read_png_file(path, max_pixels, raw) || io_read_jpeg_file(path, max_pixels, raw)) return code;
    return oi_read(path, max_pixels, raw, st);
}

static ts_code read_colour(const char *path, int64_t max_pixels, bool upright, io_image *image, ts_status *st)
{
    oi_image raw;
    *image = (io_image){0};
    ts_code code = read_raw(path, max_pixels, &raw, st);
    if (code != TS_OK) return code;
    code = convert(path, &raw, upright, image, st);
    oi_free(&raw);
    return code;
}

ts_code io_read_photo(const char *path, int64_t max_pixels, io_image *image, ts_status *st) { return read_colour(path, max_pixels, true, image, st); }

ts_code io_read_colour_map(const char *path, int64_t max_pixels, io_image *image, ts_status *st)
{
    return read_colour(path, max_pixels, false, image, st);
}

ts_code io_read_stored(const char *path, int64_t max_pixels, double gamma, io_image *image, ts_status *st)
{
    oi_image raw;
    *image = (io_image){0};
    ts_code code = read_raw(path, max_pixels, &raw, st);
    if (code != TS_OK) return code;
    const bool swap = raw.orientation >= 5;
    code = io_image_create(image, swap ? raw.height : raw.width, swap ? raw.width : raw.height, 3, st);
    float *out = image->data;
    for (int y = 0; code == TS_OK && y < image->height; y++)
        for (int x = 0; x < image->width; x++, out += 3) {
            const float *in = raw.data + stored_at(raw.orientation, x, y, raw.width, raw.height) * (size_t)raw.channels;
            for (int c = 0; c < 3; c++) {
                const float v = in[raw.colour[c]];
                out[c] = !(v > 0) ? 0 : raw.floating ? powf(v, (float)(1 / gamma)) : v;
            }
        }
    oi_free(&raw);
    return code == TS_OK ? code : ts_context(st, "%s", path);
}

ts_code io_read_data(const char *path, int channels, int64_t max_pixels, io_image *image, ts_status *st)
{
    oi_image raw;
    *image = (io_image){0};
    if (channels != 1 && channels != 3) return ts_fail(st, TS_INVALID, "%s: %d channels asked for", path, channels);
    ts_code code = read_raw(path, max_pixels, &raw, st);
    if (code != TS_OK) return code;
    code = io_image_create(image, raw.width, raw.height, channels, st);
    for (size_t i = 0, n = code == TS_OK ? (size_t)raw.width * (size_t)raw.height : 0; i < n; i++) {
        const float *in = raw.data + i * (size_t)raw.channels;
        float *out = image->data + i * (size_t)channels;
        if (channels == 1) *out = raw.grey ? in[raw.colour[0]] : (in[raw.colour[0]] + in[raw.colour[1]] + in[raw.colour[2]]) / 3;
        else
            for (int c = 0; c < 3; c++) out[c] = in[raw.colour[c]];
    }
    oi_free(&raw);
    return code == TS_OK ? code : ts_context(st, "%s", path);
}
