#include "data/image/photo_rows.h"
#include "data/file.h"
#include "data/image/common_read.h"
#include "data/image/header.h"
#include "data/image/png_file.h"
#include "tensor/budget.h"
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

ts_code io_read_raw(const char *path, int64_t max_pixels, oi_image *raw, ts_status *st)
{
    bool read = false;
    *raw = (oi_image){0};
    ts_code code = io_check_file(path, st);
    if (!code) code = io_check_png(path, st);
    if (!code) code = io_read_png_file(path, max_pixels, raw, &read, st);
    if (!code && !read) code = io_read_jpeg_file(path, max_pixels, raw, &read, st);
    if (!code && !read) code = io_check_header(path, max_pixels, st);
    if (!code && !read) code = oi_read(path, max_pixels, ts_budget_left(), raw, st);
    if (!code && !read) {
        io_webp_chunks(path, raw);
        io_heif_colours(path, raw);
    }
    return code;
}

size_t io_stored_at(int orientation, int x, int y, int w, int h)
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

/* Sets p's space, or where only a profile says what the values are, that. */
static io_space space_of(const char *path, io_photo_rows *p)
{
    const oi_image *image = &p->raw;
    io_space space;
    char name[sizeof p->unread], named[IO_PNG_NAME];
    if (io_space_png(path, &space, named)) return space;
    if (io_space_icc(image->icc, image->icc_size, &space)) return space;
    if (image->icc) {
        p->profile = io_profile_open(image->icc, image->icc_size, image->grey, name, sizeof name);
        if (!p->profile && image->code_points && io_space_code_points(image->code_point, &space)) return space;
        if (!p->profile) memcpy(p->unread, name, sizeof name);
    } else snprintf(p->unread, sizeof p->unread, "%s", named); /* one that no library takes */
    if (image->code_points && io_space_code_points(image->code_point, &space)) return space;
    if (image->primaries && io_space_primaries(image->chromaticities, image->floating ? 1 : 0, &space)) return space;
    if (image->floating || image->linear) return io_space_linear();
    return image->adobe ? io_space_adobe_rgb() : io_space_srgb();
}

static bool is_transparent(const oi_image *raw)
{
    const size_t pixels = (size_t)raw->width * (size_t)raw->height;
    bool opaque = true;
    for (size_t i = 0; raw->alpha >= 0 && i < pixels && opaque; i++)
        opaque = oi_value(raw, i * (size_t)raw->channels + (size_t)raw->alpha) > 0.9999f;
    return !opaque;
}

static bool shows_through(const oi_image *raw) { return raw->alpha >= 0 && !raw->associated; }

/* Integers have few different values: the curve is evaluated once for each. */
static bool build_tables(io_photo_rows *p)
{
    const int levels = p->raw.levels;
    p->tables = malloc(3 * (size_t)levels * sizeof(float));
    if (!p->tables) return false;
    p->plain = p->space.identity && !shows_through(&p->raw);
    for (int i = 0; i < levels; i++) {
        float rgb[3];
        for (int c = 0; c < 3; c++) rgb[c] = io_curve_value(&p->space.curve[c], (float)i / (float)(levels - 1));
        if (p->plain) io_space_matrix(&p->space, rgb);
        for (int c = 0; c < 3; c++) p->tables[c * levels + i] = rgb[c];
    }
    return true;
}

ts_code io_photo_open(const char *path, int64_t max_pixels, bool photograph, io_photo_rows *p, ts_status *st)
{
    *p = (io_photo_rows){0};
    const ts_code code = io_read_raw(path, max_pixels, &p->raw, st);
    if (code) return code;
    p->space = space_of(path, p);
    p->orientation = photograph ? p->raw.orientation : 1;
    p->transparent = photograph && is_transparent(&p->raw);
    if (!p->transparent) p->raw.alpha = -1;
    const bool swap = p->orientation >= 5;
    p->width = swap ? p->raw.height : p->raw.width;
    p->height = swap ? p->raw.width : p->raw.height;
    if (p->raw.floating || p->profile || build_tables(p)) return TS_OK;
    io_photo_close(p);
    return ts_fail(st, TS_NOMEM, "%s: out of memory", path);
}

void io_photo_close(io_photo_rows *p)
{
    free(p->tables);
    io_profile_close(&p->profile);
    oi_free(&p->raw);
    *p = (io_photo_rows){0};
}

static float lookup(const float *table, int levels, float v)
{
    int i = v > 0 ? (int)(v * (float)(levels - 1) + 0.5f) : 0;
    return table[i < levels ? i : levels - 1];
}

/* What a profile says of one pixel. */
static void convert_by_profile(const io_photo_rows *p, size_t at, float *out)
{
    const oi_image *raw = &p->raw;
    for (int c = 0; c < 3; c++) out[c] = oi_value(raw, at + (size_t)raw->colour[c]);
    io_profile_apply(p->profile, out, 1);
    const io_space linear = io_space_linear();
    if (shows_through(raw))
        for (int c = 0; c < 3; c++) out[c] *= oi_value(raw, at + (size_t)raw->alpha);
    io_space_matrix(&linear, out);
}

/* at: of its first channel. */
static void convert_pixel(const io_photo_rows *p, size_t at, float *out)
{
    const oi_image *raw = &p->raw;
    for (int c = 0; c < 3; c++) {
        const float v = oi_value(raw, at + (size_t)raw->colour[c]);
        out[c] = p->tables ? lookup(p->tables + c * raw->levels, raw->levels, v)
                           : io_curve_value(&p->space.curve[c], v);
    }
    if (p->plain) return;
    if (shows_through(raw))
        for (int c = 0; c < 3; c++) out[c] *= oi_value(raw, at + (size_t)raw->alpha); /* over black, in linear light */
    io_space_matrix(&p->space, out);
}

void io_photo_row(const io_photo_rows *p, int x, int y, int count, float *out)
{
    const oi_image *raw = &p->raw;
    const size_t first = io_stored_at(p->orientation, x, y, raw->width, raw->height);
    const ptrdiff_t step = count > 1
        ? (ptrdiff_t)io_stored_at(p->orientation, x + 1, y, raw->width, raw->height) - (ptrdiff_t)first
        : 0;
    const ptrdiff_t at = (ptrdiff_t)first * raw->channels, jump = step * raw->channels;
    if (p->plain && raw->type == OI_U8) { /* as nearly all are */
        const uint8_t *in = (const uint8_t *)raw->data + at;
        const float *red = p->tables, *green = red + raw->levels, *blue = green + raw->levels;
        const int r = raw->colour[0], g = raw->colour[1], b = raw->colour[2];
        for (int i = 0; i < count; i++, out += 3) {
            const uint8_t *pixel = in + i * jump;
            out[0] = red[pixel[r]], out[1] = green[pixel[g]], out[2] = blue[pixel[b]];
        }
        return;
    }
    for (int i = 0; i < count; i++)
        if (p->profile) convert_by_profile(p, (size_t)(at + i * jump), out + 3 * i);
        else convert_pixel(p, (size_t)(at + i * jump), out + 3 * i);
}
