#include "data/capture.h"
#include "data/file.h"
#include "data/image/image.h"
#include "data/name.h"
#include "tensor/budget.h"
#include <limits.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

static const char camera_file[] = "camera_pos.txt", light_file[] = "light_pos.txt", side_file[] = "image_size.txt",
                  power_file[] = "light_power.txt";
enum { TEXT_MAX = 1 << 16 };

ts_code io_capture_create(io_capture *c, int images, int size, ts_status *st)
{
    *c = (io_capture){.images = images, .size = size, .side = 1};
    if (images < 1 || images > IO_CAPTURE_IMAGES)
        return ts_fail(st, TS_INVALID, "a capture of %d pictures: 1 to %d are possible", images, IO_CAPTURE_IMAGES);
    const double bytes = (double)images * size * size * 3 * sizeof(float);
    if (bytes > IO_LARGE && ts_budget_check(bytes, st) != TS_OK)
        return ts_context(st, "%d pictures of %d x %d pixels", images, size, size);
    c->image = calloc((size_t)images * (size_t)size * (size_t)size * 3, sizeof *c->image);
    return c->image ? TS_OK
                    : ts_fail(st, TS_NOMEM, "out of memory for %d pictures of %d x %d pixels", images, size, size);
}

void io_capture_free(io_capture *c)
{
    free(c->image);
    for (int i = 0; i < IO_CAPTURE_IMAGES; i++) free(c->source[i].file);
    *c = (io_capture){0};
}

ts_code io_capture_note(io_capture *c, int picture, const char *file, int side, const float *square, ts_status *st)
{
    io_capture_source *s = &c->source[picture];
    *s = (io_capture_source){strdup(file), side, io_levels_of(square, (int64_t)c->size * c->size * 3)};
    return s->file ? TS_OK : ts_fail(st, TS_NOMEM, "%s: out of memory", file);
}

static ts_code join(char path[PATH_MAX], const char *folder, const char *name, ts_status *st)
{
    return snprintf(path, PATH_MAX, "%s/%s", folder, name) < PATH_MAX
        ? TS_OK
        : ts_fail(st, TS_INVALID, "%s: the name is too long", folder);
}

bool io_is_capture(const char *folder)
{
    char path[PATH_MAX];
    ts_status st = {0};
    return join(path, folder, camera_file, &st) == TS_OK && access(path, F_OK) == 0;
}

/* Lines of `columns` finite numbers between commas or blanks; empty lines are ignored. The number of lines, or -1
 * with st. */
static int read_table(const char *folder, const char *name, int columns, int most, float *value, ts_status *st)
{
    char path[PATH_MAX], *text;
    size_t size;
    int rows = 0, line = 1;
    if (join(path, folder, name, st) != TS_OK || io_read_bytes(path, TEXT_MAX, &text, &size, st) != TS_OK) return -1;
    const char *p = text;
    if (!strncmp(p, "\xef\xbb\xbf", 3)) p += 3; /* a byte-order mark */
    for (; *p; line++) {
        int column = 0;
        bool bad = false;
        for (p += strspn(p, " \t\r"); *p && *p != '\n' && !bad; column++) {
            char *end;
            const float v = strtof(p, &end);
            bad = end == p || !isfinite(v) || column == columns || rows == most;
            if (!bad) value[rows * columns + column] = v;
            p = end + strspn(end, " \t\r");
            if (*p == ',' && column + 1 < columns) p += 1 + strspn(p + 1, " \t\r");
        }
        bad = bad || (column && column != columns);
        if (bad) {
            if (rows == most) ts_fail(st, TS_FORMAT, "%s:%d: more than %d lines", path, line, most);
            else
                ts_fail(st, TS_FORMAT, "%s:%d: not %d finite number%s%s", path, line, columns, columns > 1 ? "s" : "",
                        columns > 1 ? " between commas" : "");
            free(text);
            return -1;
        }
        rows += column > 0;
        if (*p == '\n') p++;
    }
    free(text);
    return rows;
}

static ts_code read_places(const char *folder, const char *name, float side, float place[IO_CAPTURE_IMAGES][3],
                           int *count, ts_status *st)
{
    *count = read_table(folder, name, 3, IO_CAPTURE_IMAGES, place[0], st);
    if (*count < 0) return st->code;
    if (*count == 0)
        return ts_fail(st, TS_FORMAT, "%s/%s: is empty: it should have a line x,y,z for each picture", folder, name);
    for (int i = 0; i < *count; i++) {
        if (!(place[i][2] > 0))
            return ts_fail(st, TS_FORMAT, "%s/%s: number %d has z = %g: it should be above the sample", folder, name,
                           i + 1, (double)place[i][2]);
        for (int k = 0; k < 3; k++) place[i][k] /= side;
    }
    return TS_OK;
}

static ts_code read_picture(const char *folder, int number, io_capture *c, int size, int64_t max_pixels, ts_status *st)
{
    char path[PATH_MAX], name[16];
    io_image image = {0}, square = {0};
    snprintf(name, sizeof name, "%02d.png", number);
    ts_code code = join(path, folder, name, st);
    if (!code) code = io_read_data(path, 3, max_pixels, &image, st);
    if (!code && image.width != image.height)
        code = ts_fail(st, TS_FORMAT, "%s: %d x %d pixels: a rectified picture of the sample should be square", path,
                       image.width, image.height);
    for (size_t i = 0; !code && i < (size_t)image.width * (size_t)image.height * 3; i++)
        image.data[i] = powf(fmaxf(image.data[i], 0), 2.2f);
    if (!code && number == 0) {
        const io_capture before = *c;
        code = io_capture_create(c, before.images, size > 0 ? size : image.width, st);
        memcpy(c->camera, before.camera, sizeof c->camera);
        memcpy(c->light, before.light, sizeof c->light);
        memcpy(c->power, before.power, sizeof c->power);
        c->side = before.side;
    }
    if (!code) code = io_centre_square(&image, c->size, 0, &square, st);
    const size_t values = (size_t)c->size * (size_t)c->size * 3;
    if (!code) memcpy(c->image + (size_t)number * values, square.data, values * sizeof(float));
    if (!code) code = io_capture_note(c, number, path, image.width, square.data, st);
    io_image_free(&image);
    io_image_free(&square);
    return code;
}

ts_code io_read_capture(const char *folder, int size, int64_t max_pixels, io_capture *c, ts_status *st)
{
    *c = (io_capture){0};
    if (!io_is_capture(folder))
        return ts_fail(st, TS_IO, "%s: is no folder of a capture: it has no %s", folder, camera_file);
    int lights = 0, rows = read_table(folder, side_file, 1, 1, &c->side, st);
    ts_code code = rows < 0 ? st->code : TS_OK;
    if (!code && (rows != 1 || !(c->side > 0)))
        code = ts_fail(st, TS_FORMAT, "%s/%s: should be one number, the sample's side in centimetres", folder,
                       side_file);
    if (!code) {
        rows = read_table(folder, power_file, 3, 1, c->power, st);
        if (rows < 0) code = st->code;
        else if (rows != 1 || !(c->power[0] > 0 && c->power[1] > 0 && c->power[2] > 0))
            code = ts_fail(st, TS_FORMAT, "%s/%s: should be one line r,g,b of numbers over 0", folder, power_file);
    }
    for (int k = 0; k < 3 && !code; k++) c->power[k] /= c->side * c->side;
    if (!code) code = read_places(folder, camera_file, c->side, c->camera, &c->images, st);
    if (!code) code = read_places(folder, light_file, c->side, c->light, &lights, st);
    if (!code && lights != c->images)
        code = ts_fail(st, TS_FORMAT, "%s: %d lines in %s, but %d in %s", folder, c->images, camera_file, lights,
                       light_file);
    char path[PATH_MAX], name[16];
    snprintf(name, sizeof name, "%02d.png", c->images);
    if (!code && c->images < IO_CAPTURE_IMAGES && join(path, folder, name, st) == TS_OK && access(path, F_OK) == 0)
        code = ts_fail(st, TS_FORMAT, "%s: there is a %s, but %s has only %d lines", folder, name, camera_file,
                       c->images);
    for (int i = 0; i < c->images && !code; i++) code = read_picture(folder, i, c, size, max_pixels, st);
    if (code) io_capture_free(c);
    else io_name_of_folder(folder, c->name, sizeof c->name);
    return code;
}

/* c->image in the file's encoding. */
static ts_code write_picture(const char *folder, int number, const io_capture *c, io_image *image, ts_status *st)
{
    char path[PATH_MAX], name[16];
    const size_t values = (size_t)c->size * (size_t)c->size * 3;
    snprintf(name, sizeof name, "%02d.png", number);
    for (size_t i = 0; i < values; i++)
        image->data[i] = powf(fminf(fmaxf(c->image[(size_t)number * values + i], 0), 1), 1 / 2.2f);
    const ts_code code = join(path, folder, name, st);
    return code ? code : io_write_png(path, image, 8, false, st);
}

static ts_code write_text(const char *folder, const char *name, const float *value, int rows, int columns, float scale,
                          ts_status *st)
{
    char path[PATH_MAX], text[IO_CAPTURE_IMAGES * 3 * 24];
    size_t used = 0;
    for (int i = 0; i < rows * columns; i++) /* nine digits bring every float back */
        used += (size_t)snprintf(text + used, sizeof text - used, "%.9g%c", (double)value[i] * (double)scale,
                                 (i + 1) % columns ? ',' : '\n');
    const ts_code code = join(path, folder, name, st);
    return code ? code : io_write_bytes(path, text, used, st);
}

ts_code io_write_capture(const char *folder, const io_capture *c, ts_status *st)
{
    io_image image;
    ts_code code = io_image_create(&image, c->size, c->size, 3, st);
    for (int i = 0; i < c->images && !code; i++) code = write_picture(folder, i, c, &image, st);
    io_image_free(&image);
    if (!code) code = write_text(folder, camera_file, c->camera[0], c->images, 3, c->side, st);
    if (!code) code = write_text(folder, light_file, c->light[0], c->images, 3, c->side, st);
    if (!code) code = write_text(folder, side_file, &c->side, 1, 1, 1, st);
    if (!code) code = write_text(folder, power_file, c->power, 1, 3, c->side * c->side, st);
    return code;
}
