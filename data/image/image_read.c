#include "data/image/image_read.h"
#include "data/image/image.h"
#include "data/image/photo_rows.h"
#include "tensor/team.h"
#include <math.h>

typedef struct reading {
    const io_photo_rows *p;
    float *to;
} reading;

static void read_rows(const void *job, int64_t begin, int64_t end)
{
    const reading *r = job;
    for (int64_t y = begin; y < end; y++)
        io_photo_row(r->p, 0, (int)y, r->p->width, r->to + (size_t)y * (size_t)r->p->width * 3);
}

static ts_code read_colour(const char *path, int64_t max_pixels, bool photograph, io_image *image, ts_status *st)
{
    io_photo_rows p;
    *image = (io_image){0};
    ts_code code = io_photo_open(path, max_pixels, photograph, &p, st);
    if (code) return code;
    code = io_image_create(image, p.width, p.height, 3, st);
    if (code) ts_context(st, "%s", path);
    if (!code) ts_for(0, p.height, 1, read_rows, &(reading){&p, image->data});
    io_photo_close(&p);
    return code;
}

ts_code io_read_photo(const char *path, int64_t max_pixels, io_image *image, ts_status *st)
{
    return read_colour(path, max_pixels, true, image, st);
}

ts_code io_read_colour_map(const char *path, int64_t max_pixels, io_image *image, ts_status *st)
{
    return read_colour(path, max_pixels, false, image, st);
}

ts_code io_read_stored(const char *path, int64_t max_pixels, double gamma, io_image *image, io_photo_facts *facts,
                       ts_status *st)
{
    oi_image raw;
    *image = (io_image){0};
    ts_code code = io_read_raw(path, max_pixels, &raw, st);
    if (code != TS_OK) return code;
    const bool swap = raw.orientation >= 5;
    code = io_image_create(image, swap ? raw.height : raw.width, swap ? raw.width : raw.height, 3, st);
    if (facts) *facts = (io_photo_facts){.width = image->width, .height = image->height, .lens = raw.lens};
    float *out = image->data;
    for (int y = 0; code == TS_OK && y < image->height; y++)
        for (int x = 0; x < image->width; x++, out += 3) {
            const size_t at = io_stored_at(raw.orientation, x, y, raw.width, raw.height) * (size_t)raw.channels;
            for (int c = 0; c < 3; c++) {
                const float v = oi_value(&raw, at + (size_t)raw.colour[c]);
                out[c] = raw.floating ? powf(io_light(v), (float)(1 / gamma)) : v;
            }
        }
    oi_free(&raw);
    return code == TS_OK ? code : ts_context(st, "%s", path);
}

/* over_black: what is transparent counts as black. */
static ts_code read_data(const char *path, int channels, bool upright, bool over_black, int64_t max_pixels,
                         io_image *image, ts_status *st)
{
    oi_image raw;
    *image = (io_image){0};
    ts_code code = io_read_raw(path, max_pixels, &raw, st);
    if (code != TS_OK) return code;
    const int orientation = upright ? raw.orientation : 1;
    const bool swap = orientation >= 5;
    code = io_image_create(image, swap ? raw.height : raw.width, swap ? raw.width : raw.height, channels, st);
    float *out = image->data;
    for (int y = 0; code == TS_OK && y < image->height; y++)
        for (int x = 0; x < image->width; x++, out += channels) {
            const size_t at = io_stored_at(orientation, x, y, raw.width, raw.height) * (size_t)raw.channels;
            float in[3];
            const bool covered = over_black && raw.alpha >= 0 && !raw.associated;
            const float alpha = covered ? oi_value(&raw, at + (size_t)raw.alpha) : 1;
            for (int c = 0; c < 3; c++) in[c] = oi_value(&raw, at + (size_t)raw.colour[c]) * alpha;
            if (channels == 1) *out = io_light(raw.grey ? in[0] : (in[0] + in[1] + in[2]) / 3);
            else
                for (int c = 0; c < 3; c++) out[c] = in[c];
        }
    oi_free(&raw);
    return code == TS_OK ? code : ts_context(st, "%s", path);
}

ts_code io_read_data(const char *path, int channels, int64_t max_pixels, io_image *image, ts_status *st)
{
    *image = (io_image){0};
    if (channels != 1 && channels != 3) return ts_fail(st, TS_INVALID, "%s: %d channels asked for", path, channels);
    return read_data(path, channels, false, false, max_pixels, image, st);
}

ts_code io_read_mask(const char *path, int64_t max_pixels, io_image *image, ts_status *st)
{
    return read_data(path, 1, true, true, max_pixels, image, st);
}
