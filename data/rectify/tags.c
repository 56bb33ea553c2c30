#include "data/rectify/tags.h"

#ifdef LGD_APRILTAG
#include "tensor/team.h"
#include "tensor/threads.h"
#include <apriltag/apriltag.h>
#include <apriltag/tag36h11.h>
#include <errno.h>
#include <math.h>
#include <stdatomic.h>
#include <stdlib.h>
#include <string.h>

ts_code io_tag_images(io_tag_image black[IO_SHEET_TAGS], ts_status *st)
{
    apriltag_family_t *family = tag36h11_create();
    if (!family) return ts_fail(st, TS_NOMEM, "out of memory for the tags");
    const int border = (family->total_width - family->width_at_border) / 2;
    for (int id = 0; id < IO_SHEET_TAGS; id++) {
        for (int r = 0; r < IO_TAG_CELLS; r++)
            for (int c = 0; c < IO_TAG_CELLS; c++)
                black[id][r][c] = r >= border && c >= border && r < IO_TAG_CELLS - border && c < IO_TAG_CELLS - border;
        for (unsigned i = 0; i < family->nbits; i++)
            if (family->codes[id] >> (family->nbits - 1 - i) & 1)
                black[id][(int)family->bit_y[i] + border][(int)family->bit_x[i] + border] = false;
    }
    tag36h11_destroy(family);
    return TS_OK;
}

typedef struct grey_job {
    const io_photo_rows *photo;
    uint8_t *grey;
    atomic_bool *fine;
} grey_job;

static void grey_rows(const void *job, int64_t begin, int64_t end)
{
    const grey_job *j = job;
    const size_t width = (size_t)j->photo->width;
    float *row = malloc(width * 3 * sizeof *row);
    if (!row) atomic_store(j->fine, false);
    for (int64_t y = begin; y < end && row; y++) {
        io_photo_row(j->photo, 0, (int)y, j->photo->width, row);
        for (size_t x = 0; x < width; x++) {
            const float light = 0.25f * row[3 * x] + 0.5f * row[3 * x + 1] + 0.25f * row[3 * x + 2];
            j->grey[(size_t)y * width + x] = (uint8_t)(255 * sqrtf(fminf(fmaxf(light, 0), 1)) + 0.5f);
        }
    }
    free(row);
}

/* The photograph's light as 8 bits of its square root: near to how it is encoded, whatever the file. */
static uint8_t *grey_of(const io_photo_rows *photo, int threads)
{
    const size_t width = (size_t)photo->width, height = (size_t)photo->height;
    uint8_t *grey = malloc(width * height);
    atomic_bool fine = grey != NULL;
    if (grey) ts_for(threads, photo->height, 1, grey_rows, &(grey_job){photo, grey, &fine});
    if (fine) return grey;
    free(grey);
    return NULL;
}

/* Those of the sheet; -1: one of them twice, its number in *twice. */
static int take(zarray_t *found, io_tags *tags, int *twice)
{
    for (int i = 0; i < zarray_size(found); i++) {
        apriltag_detection_t *d;
        zarray_get(found, i, &d);
        if (d->id < 0 || d->id >= IO_SHEET_TAGS) continue;
        for (int k = 0; k < tags->count; k++)
            if (tags->id[k] == d->id) return *twice = d->id, -1;
        tags->id[tags->count] = d->id;
        for (int k = 0; k < 4; k++) /* the library begins at the bottom left and goes round the other way */
            memcpy(tags->corner[tags->count][k], d->p[3 - k], sizeof d->p[0]);
        tags->count++;
    }
    return tags->count;
}

static ts_code detect(uint8_t *grey, int width, int height, int threads, io_tags *tags, ts_status *st)
{
    enum { ENOUGH = 1000 }; /* pixels of the shorter side in which tags are looked for; edges are refined in all */
    apriltag_family_t *family = tag36h11_create();
    apriltag_detector_t *detector = apriltag_detector_create();
    int twice = 0, count = 0;
    if (family && detector) {
        const int shorter = width < height ? width : height;
        image_u8_t image = {.width = width, .height = height, .stride = width, .buf = grey};
        apriltag_detector_add_family_bits(detector, family, 1);
        detector->nthreads = ts_threads_of(threads);
        detector->quad_decimate = (float)(shorter >= 2 * ENOUGH ? shorter / ENOUGH : 1);
        zarray_t *found = apriltag_detector_detect(detector, &image);
        if (found) {
            count = take(found, tags, &twice);
            apriltag_detections_destroy(found);
        }
    }
    if (detector) apriltag_detector_destroy(detector);
    if (family) tag36h11_destroy(family);
    if (!family || !detector) return ts_fail(st, TS_NOMEM, "out of memory for the tags");
    if (count < 0)
        return ts_fail(st, TS_INVALID, "tag %d of the sheet is there twice: photograph one sheet alone", twice);
    if (count == 0)
        return ts_fail(st, TS_INVALID,
                       "no tag of the sheet is seen: photograph the whole frame, sharp and not burnt out");
    if (count < IO_TAGS_LEAST)
        return ts_fail(st, TS_INVALID, "%d of the sheet's %d tags are seen, %d are needed: photograph the whole frame",
                       count, IO_SHEET_TAGS, IO_TAGS_LEAST);
    return TS_OK;
}

ts_code io_tags_find(const io_photo_rows *photo, int threads, io_tags *tags, ts_status *st)
{
    enum { SMALL = 100, LARGE = 16384 }; /* the library's own limits are near */
    *tags = (io_tags){0};
    if (photo->width < SMALL || photo->height < SMALL || photo->width > LARGE || photo->height > LARGE)
        return ts_fail(st, TS_INVALID, "%d x %d pixels: a photograph of a sheet has %d to %d a side", photo->width,
                       photo->height, SMALL, LARGE);
    uint8_t *grey = grey_of(photo, threads);
    if (!grey) return ts_fail(st, TS_NOMEM, "out of memory for %d x %d pixels", photo->width, photo->height);
    const ts_code code = detect(grey, photo->width, photo->height, threads, tags, st);
    free(grey);
    return code;
}

#else /* built without the library */

static ts_code absent(ts_status *st)
{
    return ts_fail(
        st, TS_UNSUPPORTED,
        "this program was built without libapriltag, which sheets need: install libapriltag-dev and run make");
}

ts_code io_tag_images(io_tag_image black[IO_SHEET_TAGS], ts_status *st)
{
    (void)black;
    return absent(st);
}

ts_code io_tags_find(const io_photo_rows *photo, int threads, io_tags *tags, ts_status *st)
{
    (void)photo, (void)threads;
    *tags = (io_tags){0};
    return absent(st);
}
#endif
