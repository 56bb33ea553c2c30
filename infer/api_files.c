/* The public C API's files (infer/lgd.h): photographs and masks in, maps out. */
#include "data/image/colour.h"
#include "data/material.h"
#include "infer/api.h"
#include "infer/api_model.h"
#include "infer/model_path.h"
#include "infer/output.h"
#include "infer/photograph.h"
#include "tensor/hash.h"
#include "tensor/new_file.h"
#include "tensor/threads.h"
#include <math.h>
#include <stdatomic.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { PHOTO_SIDE_MAX = 1 << 20 }; /* of pixels in memory */

int lgd_find_weights(const char *name, char *path, size_t size, lgd_error *error)
{
    ts_status st = {0};
    char found[LGD_PATH_MAX];
    if (!path || size == 0) ts_fail(&st, TS_INVALID, "lgd_find_weights: path must be given");
    else if (lgd_model_path(name, LGD_DEFAULT_MODEL, found, &st) == TS_OK) {
        const size_t length = strlen(found);
        if (length < size) memcpy(path, found, length + 1);
        else ts_fail(&st, TS_INVALID, "lgd_find_weights: %zu bytes are too few for %s", size, found);
    }
    return lgd_report(error, &st);
}

static ts_code check_side(const char *call, int side, ts_status *st)
{
    if (side >= 1 && side <= LGD_SIDE_MAX) return TS_OK;
    return ts_fail(st, TS_INVALID, "%s: side is %d and must lie in 1 .. %d", call, side, LGD_SIDE_MAX);
}

static ts_code check_threads(const char *call, int threads, ts_status *st)
{
    if (threads >= 0 && threads <= LGD_THREADS_MAX) return TS_OK;
    return ts_fail(st, TS_INVALID, "%s: threads is %d and must lie in 1 .. %d, or be 0 for all", call, threads,
                   LGD_THREADS_MAX);
}

static ts_code take_read_options(const char *call, const lgd_read_options *given, lgd_read_options *o, ts_status *st)
{
    *o = (lgd_read_options){.size = sizeof *o};
    if (lgd_take_struct(call, given, sizeof o->size, o, sizeof *o, st) != TS_OK) return st->code;
    if (o->max_pixels == 0) o->max_pixels = IO_MAX_PIXELS_DEFAULT;
    if (o->max_pixels < 0) return ts_fail(st, TS_INVALID, "%s: max_pixels is below 0", call);
    return check_threads(call, o->threads, st);
}

int lgd_read_photo(const char *path, int side, const lgd_read_options *options, float *image, lgd_facts *facts,
                   lgd_error *error)
{
    static const char call[] = "lgd_read_photo";
    ts_status st = {0};
    lgd_read_options o;
    io_photo_facts found;
    io_image square = {0};
    lgd_facts told = {.size = facts ? facts->size : sizeof told};
    if (!path || !image) ts_fail(&st, TS_INVALID, "%s: path and image must be given", call);
    else if (told.size < sizeof told.size || told.size > LGD_STRUCT_MOST)
        ts_fail(&st, TS_INVALID, "%s: facts.size is %zu: set it to sizeof(lgd_facts)", call, told.size);
    else if (check_side(call, side, &st) == TS_OK && take_read_options(call, options, &o, &st) == TS_OK)
        lgd_photograph_square(path, o.published, o.max_pixels, side, o.threads, &square, &found, &st);
    if (!st.code) {
        memcpy(image, square.data, (size_t)side * (size_t)side * 3 * sizeof *image);
        told.width = found.width;
        told.height = found.height;
        told.fov = io_lens_fov(&found.lens, found.width, found.height, told.fov_from, sizeof told.fov_from);
        memcpy(told.profile, found.profile, sizeof told.profile);
        told.transparent = found.transparent;
        if (facts) { /* of a caller that was compiled with fewer or more of them */
            const size_t known = told.size < sizeof told ? told.size : sizeof told;
            memcpy(facts, &told, known);
            memset((char *)facts + known, 0, told.size - known);
        }
    }
    io_image_free(&square);
    return lgd_report(error, &st);
}

int lgd_read_mask(const char *path, int side, int width, int height, const lgd_read_options *options,
                  unsigned char *mask, lgd_error *error)
{
    static const char call[] = "lgd_read_mask";
    ts_status st = {0};
    lgd_read_options o;
    io_image whole = {0}, square = {0};
    if (!path || !mask) ts_fail(&st, TS_INVALID, "%s: path and mask must be given", call);
    else if (check_side(call, side, &st) == TS_OK && take_read_options(call, options, &o, &st) == TS_OK)
        io_read_mask(path, o.max_pixels, &whole, &st);
    const double difference = (double)whole.width * height -
        (double)whole.height * width; /* a pixel of rounding is none */
    if (!st.code && width > 0 && height > 0 && fabs(difference) > fmax(whole.width, whole.height) + fmax(width, height))
        ts_fail(&st, TS_INVALID, "the mask %s is %d x %d pixels and the photograph %d x %d: not the same shape", path,
                whole.width, whole.height, width, height);
    if (!st.code && io_centre_square(&whole, side, o.threads, &square, &st) == TS_OK)
        for (size_t i = 0; i < (size_t)side * (size_t)side; i++) mask[i] = square.data[i] > 0;
    io_image_free(&whole);
    io_image_free(&square);
    return lgd_report(error, &st);
}

/* A row of the caller's values, linear. */
static void take_row(const void *pixels, int encoding, size_t first, int width, const io_space *space, float *row)
{
    for (size_t i = 0; i < (size_t)width; i++) {
        float v[3];
        for (size_t c = 0; c < 3; c++) {
            const size_t k = (first + i) * 3 + c;
            v[c] = encoding == LGD_SRGB8 ? (float)((const unsigned char *)pixels)[k] / 255
                : encoding == LGD_SRGB16 ? (float)((const unsigned short *)pixels)[k] / 65535
                                         : ((const float *)pixels)[k];
        }
        io_space_apply(space, v, row + i * 3);
    }
}

int lgd_square(const void *pixels, int encoding, int width, int height, int side, float *image, lgd_error *error)
{
    static const char call[] = "lgd_square";
    ts_status st = {0};
    io_image whole = {0}, square = {0};
    const io_space space = encoding == LGD_LINEAR ? io_space_linear() : io_space_srgb();
    if (!pixels || !image) ts_fail(&st, TS_INVALID, "%s: pixels and image must be given", call);
    else if (encoding != LGD_SRGB8 && encoding != LGD_SRGB16 && encoding != LGD_LINEAR)
        ts_fail(&st, TS_INVALID, "%s: encoding is %d and must be LGD_SRGB8, LGD_SRGB16 or LGD_LINEAR", call, encoding);
    else if (width < 1 || width > PHOTO_SIDE_MAX || height < 1 || height > PHOTO_SIDE_MAX)
        ts_fail(&st, TS_INVALID, "%s: %d x %d pixels: each must lie in 1 .. %d", call, width, height, PHOTO_SIDE_MAX);
    else if (check_side(call, side, &st) == TS_OK) io_image_create(&whole, width, height, 3, &st);
    for (int y = 0; y < height && !st.code; y++)
        take_row(pixels, encoding, (size_t)y * (size_t)width, width, &space,
                 whole.data + (size_t)y * (size_t)width * 3);
    if (!st.code && io_centre_square(&whole, side, 0, &square, &st) == TS_OK)
        memcpy(image, square.data, (size_t)side * (size_t)side * 3 * sizeof *image);
    io_image_free(&whole);
    io_image_free(&square);
    return lgd_report(error, &st);
}

/* path: room for folder's name, which is cut there into its parent's and its own. */
static ts_code split(const char *folder, char path[LGD_PATH_MAX], const char **parent, const char **stem, ts_status *st)
{
    size_t n = strlen(folder);
    while (n > 1 && folder[n - 1] == '/') n--;
    const char *here = memchr(folder, '/', n) ? "" : "./"; /* of the working folder */
    if (snprintf(path, LGD_PATH_MAX, "%s%.*s", here, (int)n, folder) >= LGD_PATH_MAX)
        return ts_fail(st, TS_INVALID, "lgd_write_maps: %.200s...: the name is too long", folder);
    char *slash = strrchr(path, '/');
    *stem = slash + 1;
    if (!**stem || strcmp(*stem, ".") == 0 || strcmp(*stem, "..") == 0)
        return ts_fail(st, TS_INVALID, "lgd_write_maps: '%.200s' is no name of a folder for maps", folder);
    *slash = 0;
    *parent = *path ? path : "/";
    return TS_OK;
}

/* What would make files that say nothing. */
static ts_code check_values(const float *maps, int side, const lgd_photo *photo, double ambient, const char *fov_from,
                            ts_status *st)
{
    if (!lgd_photo_can_be(photo))
        return ts_fail(
            st, TS_INVALID,
            "lgd_write_maps: light and camera of the photograph must be above the sample, its power above 0");
    if (!(ambient >= 0) || !isfinite(ambient))
        return ts_fail(st, TS_INVALID, "lgd_write_maps: ambient is %g and must be 0 or more", ambient);
    for (const char *c = fov_from ? fov_from : ""; *c; c++)
        if ((unsigned char)*c < ' ')
            return ts_fail(st, TS_INVALID, "lgd_write_maps: fov_from must be one line without control characters");
    for (size_t i = 0; i < (size_t)side * (size_t)side * MAP_CHANNELS; i++)
        if (!isfinite(maps[i]))
            return ts_fail(st, TS_NUMERIC, "lgd_write_maps: maps must be finite: value %zu of pixel %zu is not",
                           i % MAP_CHANNELS, i / MAP_CHANNELS);
    return TS_OK;
}

static ts_code order_of(const lgd_write_options *o, int side, bool photograph, lgd_order *order, ts_status *st)
{
    unsigned which = LGD_OUT_DEFAULT & ~(photograph ? 0u : LGD_OUT_RENDER);
    if (o->maps && lgd_output_parse(o->maps, &which, st) != TS_OK) return ts_context(st, "lgd_write_maps: maps");
    if (!photograph && which & (LGD_OUT_RENDER | LGD_OUT_PAGE))
        return ts_fail(st, TS_INVALID,
                       "lgd_write_maps: render and page show the photograph: photo must have its image");
    if (o->exr != LGD_EXR_AUTO && o->exr != LGD_EXR_HALF && o->exr != LGD_EXR_FLOAT)
        return ts_fail(st, TS_INVALID, "lgd_write_maps: exr is %d and must be LGD_EXR_AUTO, _HALF or _FLOAT", o->exr);
    if (check_threads("lgd_write_maps", o->threads, st) != TS_OK) return st->code;
    *order = (lgd_order){.which = lgd_output_complete(which, o->metallic),
                         .directx = o->directx,
                         .metallic = o->metallic,
                         .half = o->exr == LGD_EXR_HALF || (o->exr == LGD_EXR_AUTO && side > LGD_HALF_ABOVE),
                         .repeats = o->seamless,
                         .ambient = o->ambient,
                         .threads = ts_threads_of(o->threads)};
    if (lgd_order_check(order, st) != TS_OK) return ts_context(st, "lgd_write_maps");
    return TS_OK;
}

/* Of many folders in one parent the first alone reads it to its end. */
static void sweep_once(const char *parent)
{
    static atomic_uint_least64_t last;
    const uint64_t hash = ts_hash(parent, strlen(parent), 1);
    if (atomic_exchange(&last, hash) != hash) ts_sweep(parent);
}

int lgd_write_maps(const char *folder, const float *maps, int side, const lgd_photo *photo,
                   const lgd_write_options *options, lgd_error *error)
{
    static const char call[] = "lgd_write_maps";
    ts_status st = {0};
    lgd_write_options o = {.size = sizeof o};
    lgd_order order;
    io_material m = {0};
    const lgd_photo flash = lgd_flash_photo(NULL), *taken = photo ? photo : &flash;
    char path[LGD_PATH_MAX], *from = NULL;
    const char *parent = NULL, *stem = NULL;
    if (!folder || !maps) ts_fail(&st, TS_INVALID, "%s: folder and maps must be given", call);
    else if (check_side(call, side, &st) == TS_OK &&
             lgd_take_struct(call, options, sizeof o.size, &o, sizeof o, &st) == TS_OK &&
             order_of(&o, side, taken->image, &order, &st) == TS_OK &&
             check_values(maps, side, taken, o.ambient, o.fov_from, &st) == TS_OK &&
             split(folder, path, &parent, &stem, &st) == TS_OK && io_material_create(&m, side, &st) == TS_OK) {
        lgd_encode(maps, side, order.threads, m.maps);
        const char *how = o.fov_unknown ? lgd_fov_assumption(taken) : "";
        if (asprintf(&from, "%s%s", how, o.fov_from ? o.fov_from : "given") < 0) {
            from = NULL;
            ts_fail(&st, TS_NOMEM, "%s: out of memory", call);
        } else {
            order.fov_from = from;
            sweep_once(parent);
            lgd_output_write(parent, stem, &m, taken, &order, NULL, &st);
        }
    }
    free(from);
    io_material_free(&m);
    return lgd_report(error, &st);
}
