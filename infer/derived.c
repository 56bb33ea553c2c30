#include "infer/derived.h"
#include "data/height.h"
#include "data/occlusion.h"
#include "tensor/new_file.h"
#include <math.h>

static ts_code write_png(const char *folder, unsigned which, const io_image *image, int bits, bool srgb, ts_status *st)
{
    char path[TS_PATH_LENGTH];
    int k = 0;
    while (which >> k != 1) k++;
    return ts_path_in(path, folder, lgd_files[k], st) ? st->code : io_write_png(path, image, bits, srgb, st);
}

ts_code lgd_derive(const io_material *m, unsigned which, bool repeats, int threads, lgd_derived *d,
                   lgd_output_result *facts, ts_status *st)
{
    const int n = m->size;
    ts_code code = TS_OK;
    *d = (lgd_derived){.m = m};
    if (which & (LGD_OUT_HEIGHT | LGD_OUT_AO | LGD_OUT_ORM)) {
        code = io_image_create(&d->height, n, n, 1, st);
        if (!code) code = io_height(m, repeats, d->height.data, threads, st);
    }
    if (!code && which & (LGD_OUT_AO | LGD_OUT_ORM)) {
        code = io_image_create(&d->occlusion, n, n, 1, st);
        if (!code) io_occlusion(n, d->height.data, repeats, d->occlusion.data, threads);
    }
    if (!code && which & (LGD_OUT_BASECOLOR | LGD_OUT_METALLIC | LGD_OUT_ORM)) {
        code = io_image_create(&d->base, n, n, 3, st);
        if (!code) code = io_image_create(&d->metal, n, n, 1, st);
        if (!code) facts->lost = io_to_metallic(m, d->base.data, d->metal.data, threads);
    }
    return code;
}

/* Over the whole range of the file. */
static ts_code write_height(const char *folder, io_image *height, lgd_output_result *facts, ts_status *st)
{
    const size_t pixels = (size_t)height->width * (size_t)height->height;
    float low = INFINITY, high = -INFINITY;
    for (size_t i = 0; i < pixels; i++) {
        low = fminf(low, height->data[i]);
        high = fmaxf(high, height->data[i]);
    }
    facts->low = low, facts->high = high;
    const float scale = high > low ? 1 / (high - low) : 0;
    for (size_t i = 0; i < pixels; i++) height->data[i] = (height->data[i] - low) * scale;
    return write_png(folder, LGD_OUT_HEIGHT, height, 16, false, st);
}

static ts_code write_orm(const char *folder, const lgd_derived *d, ts_status *st)
{
    const size_t pixels = (size_t)d->m->size * (size_t)d->m->size;
    io_image orm;
    ts_code code = io_image_create(&orm, d->m->size, d->m->size, 3, st);
    for (size_t i = 0; i < pixels && !code; i++) {
        orm.data[3 * i] = d->occlusion.data[i];
        orm.data[3 * i + 1] = io_unit(d->m->maps[i * MAP_CHANNELS + MAP_ROUGHNESS]);
        orm.data[3 * i + 2] = d->metal.data[i];
    }
    if (!code) code = write_png(folder, LGD_OUT_ORM, &orm, 16, false, st);
    io_image_free(&orm);
    return code;
}

ts_code lgd_write_derived(const char *folder, lgd_derived *d, unsigned which, lgd_output_result *facts, ts_status *st)
{
    ts_code code = TS_OK;
    if (which & LGD_OUT_ORM) code = write_orm(folder, d, st);
    if (!code && which & LGD_OUT_AO) code = write_png(folder, LGD_OUT_AO, &d->occlusion, 8, false, st);
    if (!code && which & LGD_OUT_BASECOLOR) code = write_png(folder, LGD_OUT_BASECOLOR, &d->base, 8, true, st);
    if (!code && which & LGD_OUT_METALLIC) code = write_png(folder, LGD_OUT_METALLIC, &d->metal, 16, false, st);
    if (!code && which & LGD_OUT_HEIGHT) code = write_height(folder, &d->height, facts, st);
    return code;
}

void lgd_derived_free(lgd_derived *d)
{
    io_image_free(&d->height);
    io_image_free(&d->occlusion);
    io_image_free(&d->base);
    io_image_free(&d->metal);
}
