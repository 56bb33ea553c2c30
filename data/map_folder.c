/* Map folders: the images of a set are read, resampled to one size and combined to maps. */
#include "data/map_folder.h"
#include "data/image/image_read.h"
#include "data/name.h"
#include <limits.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* A map whose name is of several may hold one alone (CarPaintMetallic_Roughness): then its channels are equal, but for
 * what JPEG changes. */
static ts_code check_channels(const char *path, int kind, ts_status *st)
{
    io_image image;
    const ts_code code = io_read_data(path, 3, IO_MAX_PIXELS_DEFAULT, &image, st);
    if (code != TS_OK) return code;
    const size_t pixels = (size_t)image.width * (size_t)image.height;
    double differ = 0;
    for (size_t i = 0; i < pixels; i++) {
        const float *v = image.data + 3 * i;
        differ += (double)(fmaxf(v[0], fmaxf(v[1], v[2])) - fminf(v[0], fminf(v[1], v[2])));
    }
    io_image_free(&image);
    if (!(differ > 0.05 * (double)pixels)) return TS_OK;
    return ts_fail(st, TS_INVALID,
                   "%s: a packed map must be taken apart (it is another in each channel); if it is not, name it in "
                   "meta.txt (file.%s: ...)",
                   path, io_map_kind_name[kind]);
}

/* Reads one map; its normals as unit vectors, OpenGL y. */
static ts_code read_map(const char *folder, const io_map_set *set, int kind, io_image *image, ts_status *st)
{
    char path[PATH_MAX];
    if (snprintf(path, sizeof path, "%s/%s", folder, set->file[kind]) >= (int)sizeof path)
        return ts_fail(st, TS_INVALID, "%s: name too long", folder);
    bool colour = kind == IO_BASECOLOR || kind == IO_DIFFUSE_MAP || kind == IO_SPECULAR_MAP;
    if (colour && !set->linear[kind]) return io_read_colour_map(path, IO_MAX_PIXELS_DEFAULT, image, st);
    ts_code code = set->packed[kind] ? check_channels(path, kind, st) : TS_OK;
    if (code == TS_OK)
        code = io_read_data(path, colour || kind == IO_NORMAL_MAP ? 3 : 1, IO_MAX_PIXELS_DEFAULT, image, st);
    if (code != TS_OK) return code;
    const size_t n = (size_t)image->width * (size_t)image->height;
    for (size_t i = 0; colour && i < 3 * n; i++) image->data[i] = io_light(image->data[i]);
    for (size_t i = 0; kind == IO_NORMAL_MAP && i < n; i++) {
        float stored[3];
        memcpy(stored, image->data + 3 * i, sizeof stored);
        io_normal_decode(stored, set->directx, image->data + 3 * i);
    }
    return TS_OK;
}

static int short_side(const io_image *image) { return image->width < image->height ? image->width : image->height; }

/* Of two maps the sides of the smaller are those of the larger times one number, to rounding of less than a pixel. A
 * map of one pixel is the same everywhere and lies right on any other. */
static bool are_alike(const io_image *a, const io_image *b)
{
    const int64_t across = (int64_t)a->width * b->height, down = (int64_t)b->width * a->height;
    const int most = (int64_t)a->width * a->height > (int64_t)b->width * b->height
        ? (a->width > a->height ? a->width : a->height)
        : (b->width > b->height ? b->width : b->height);
    const bool one = (a->width == 1 && a->height == 1) || (b->width == 1 && b->height == 1);
    return one || llabs(across - down) < most;
}

/* The centre squares of maps of several shapes do not lie on each other. */
static ts_code check_shapes(const char *folder, const io_map_set *set, const io_image map[IO_MAP_KINDS], ts_status *st)
{
    for (int a = 0; a < IO_MAP_KINDS; a++)
        for (int b = a + 1; b < IO_MAP_KINDS; b++)
            if (map[a].data && map[b].data && !are_alike(&map[a], &map[b]))
                return ts_fail(st, TS_INVALID, "%s: %s is %d x %d and %s %d x %d: not the same shape, crop them alike",
                               folder, set->file[a], map[a].width, map[a].height, set->file[b], map[b].width,
                               map[b].height);
    return TS_OK;
}

static ts_code to_square(io_image *image, int size, ts_status *st)
{
    if (image->width == size && image->height == size) return TS_OK;
    io_image square;
    ts_code code = io_centre_square(image, size, 0, &square, st);
    if (code != TS_OK) return code;
    io_image_free(image);
    *image = square;
    return TS_OK;
}

/* Metallic workflow: a dielectric's F0 of 0.04 (Burley, "Physically Based Shading at Disney", 2012; the glTF 2.0
 * specification, appendix B) changes to the base colour. out: diffuse 3, F0 3, roughness, normal 3. */
enum { MIXED = 10 };
static void mix_pixel(const io_map_set *set, const io_image map[IO_MAP_KINDS], size_t i, float out[MIXED])
{
    const float *base = (map[IO_BASECOLOR].data ? map[IO_BASECOLOR].data : map[IO_DIFFUSE_MAP].data) + 3 * i;
    float metallic = map[IO_METALLIC_MAP].data ? fminf(fmaxf(map[IO_METALLIC_MAP].data[i], 0), 1) : 0;
    for (int c = 0; c < 3; c++) {
        out[c] = set->specular ? base[c] : base[c] * (1 - metallic);
        out[3 + c] = set->specular ? map[IO_SPECULAR_MAP].data[3 * i + (size_t)c]
                                   : 0.04f * (1 - metallic) + base[c] * metallic;
        out[7 + c] = map[IO_NORMAL_MAP].data[3 * i + (size_t)c];
    }
    out[6] = map[IO_ROUGHNESS_MAP].data ? map[IO_ROUGHNESS_MAP].data[i] : 1 - map[IO_GLOSS_MAP].data[i];
}

static void put_pixels(const io_image *mixed, io_material *m)
{
    for (size_t i = 0, n = (size_t)m->size * (size_t)m->size; i < n; i++) {
        const float *v = mixed->data + i * MIXED;
        io_texel t = {.roughness = v[6]};
        memcpy(t.diffuse, v, sizeof t.diffuse);
        memcpy(t.specular, v + 3, sizeof t.specular);
        memcpy(t.normal, v + 7, sizeof t.normal); /* averaged vectors: put gives them unit length again */
        io_texel_put(m->maps + i * MAP_CHANNELS, &t);
    }
}

/* Products are formed at the largest stored size and averaged after: the mean of base colour times metallic is not the
 * product of means. */
static ts_code combine(const io_map_set *set, io_image map[IO_MAP_KINDS], int size, io_material *m, ts_status *st)
{
    int side = 0;
    for (int k = 0; k < IO_MAP_KINDS; k++)
        if (map[k].data && short_side(&map[k]) > side) side = short_side(&map[k]);
    ts_code code = TS_OK;
    for (int k = 0; k < IO_MAP_KINDS && code == TS_OK; k++)
        if (map[k].data) code = to_square(&map[k], side, st);
    io_image mixed = {0};
    if (code == TS_OK) code = io_image_create(&mixed, side, side, MIXED, st);
    for (size_t i = 0, n = (size_t)side * (size_t)side; i < n && code == TS_OK; i++)
        mix_pixel(set, map, i, mixed.data + i * MIXED);
    for (int k = 0; k < IO_MAP_KINDS; k++) io_image_free(&map[k]);
    if (code == TS_OK) code = to_square(&mixed, size > 0 ? size : side, st);
    if (code == TS_OK) code = io_material_create(m, mixed.width, st);
    if (code == TS_OK) put_pixels(&mixed, m);
    io_image_free(&mixed);
    return code;
}

ts_code io_read_map_folder(const char *path, const io_map_convention *given, int size, io_material *m, ts_status *st)
{
    io_map_set set;
    io_image map[IO_MAP_KINDS] = {{0}};
    memset(m, 0, sizeof *m);
    ts_code code = io_describe_map_folder(path, given, &set, st);
    if (code != TS_OK) return code;
    for (int k = 0; k < IO_MAP_KINDS && code == TS_OK; k++) {
        bool wanted = set.file[k][0] && !(k == IO_METALLIC_MAP && set.specular) &&
            !(k == IO_SPECULAR_MAP && !set.specular);
        if (wanted) code = read_map(path, &set, k, &map[k], st);
    }
    if (code == TS_OK) code = check_shapes(path, &set, map, st);
    if (code == TS_OK && combine(&set, map, size, m, st) != TS_OK) code = ts_context(st, "%s", path);
    for (int k = 0; k < IO_MAP_KINDS; k++) io_image_free(&map[k]);
    if (code == TS_OK) io_name_of_folder(path, m->name, sizeof m->name);
    return code;
}
