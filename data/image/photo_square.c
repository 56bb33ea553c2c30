/* The largest centred square of a photograph, resampled. As floats there are only as many rows at a time as the filter
 * reads: all of 12 million pixels take three times as long as the rest of the work. */
#include "data/image/image.h"
#include "data/image/photo_rows.h"
#include "tensor/resample.h"
#include "tensor/team.h"
#include "tensor/threads.h"
#include <string.h>

enum { BAND = 4, LARGE = 1024 }; /* rows of the result at a time; pixels a side from which on threads pay */
enum { FEW = 1 << 19 };          /* bytes of the filter and the rows that most photographs need at once */

typedef struct cut {
    const io_photo_rows *photo;
    const ts_taps *taps; /* of both axes */
    int side, x, y;      /* of the photograph */
} cut;

/* Rows of the photograph that rows j .. j + count - 1 of the result read: *first up to what is returned. */
static int read_by(const ts_taps *t, int j, int count, int *first)
{
    const int end = j + count - 1;
    *first = t->first[j];
    return t->first[end] + t->offset[end + 1] - t->offset[end];
}

/* Rows begin .. end - 1 of the result; rows: room for those of the photograph that a band reads. Each of these is made
 * once. */
static void make(const cut *c, int begin, int end, float *rows, float *to)
{
    const size_t row = (size_t)c->side * 3;
    int have = 0, until = 0; /* the photograph's rows in rows */
    for (int j = begin, first; j < end; j += BAND) {
        const int count = j + BAND < end ? BAND : end - j, last = read_by(c->taps, j, count, &first);
        if (until > first)
            memmove(rows, rows + (size_t)(first - have) * row, (size_t)(until - first) * row * sizeof *rows);
        for (int y = until > first ? until : first; y < last; y++)
            io_photo_row(c->photo, c->x, c->y + y, c->side, rows + (size_t)(y - first) * row);
        have = first, until = last;
        ts_taps own = ts_taps_part(c->taps, j, count);
        int from[BAND];
        for (int i = 0; i < count; i++) from[i] = c->taps->first[j + i] - first;
        own.in = last - first;
        own.first = from;
        ts_resample(1, 3, &own, c->taps, rows, to + (size_t)j * (size_t)c->taps->out * 3, false, 1);
    }
}

typedef struct resampling {
    const cut *c;
    int size, each; /* rows of the square; of a part */
    size_t most;    /* floats of the photograph that a part holds at once */
    float *rows, *to;
} resampling;

static void make_part(const void *job, int64_t k)
{
    const resampling *r = job;
    const int begin = (int)k * r->each, end = begin + r->each;
    make(r->c, begin < r->size ? begin : r->size, end < r->size ? end : r->size, r->rows + (size_t)k * r->most, r->to);
}

static ts_code resample(const io_photo_rows *photo, const cut *c, int most_threads, ts_arena *arena, io_image *square,
                        ts_status *st)
{
    const int size = c->taps->out, useful = c->side < LARGE ? 1 : ts_threads_of(most_threads);
    int threads = useful < size ? useful : size;
    size_t most = 0;
    for (int j = 0; j < size; j++) { /* wherever a band begins */
        int first;
        const int last = read_by(c->taps, j, j + BAND < size ? BAND : size - j, &first);
        if ((size_t)(last - first) > most) most = (size_t)(last - first);
    }
    /* together parts hold no more than the photograph does, if one alone does not */
    const size_t part = most * (size_t)c->side * 3 * sizeof(float),
                 held = (size_t)photo->width * (size_t)photo->height * (size_t)photo->raw.channels *
        (photo->raw.type == OI_U8        ? 1
             : photo->raw.type == OI_U16 ? 2
                                         : 4),
                 parts = held / part;
    if (parts < (size_t)threads) threads = parts > 1 ? (int)parts : 1;
    const int each = (size + threads - 1) / threads;
    float *rows = ts_arena_alloc(arena, (size_t)threads * part);
    if (!rows) return ts_fail(st, TS_NOMEM, "no memory for a square of %d x %d pixels", photo->width, photo->height);
    ts_tasks(threads, threads, make_part, &(resampling){c, size, each, most * (size_t)c->side * 3, rows, square->data});
    return TS_OK;
}

ts_code io_read_photo_square(const char *path, int64_t max_pixels, int size, int threads, io_image *square,
                             io_photo_facts *facts, ts_status *st)
{
    io_photo_rows photo;
    *square = (io_image){0};
    if (size < 1) return ts_fail(st, TS_INVALID, "an image of %d x %d pixels", size, size);
    ts_code code = io_photo_open(path, max_pixels, true, &photo, st);
    if (code) return code;
    const int side = photo.width < photo.height ? photo.width : photo.height;
    ts_arena *arena = ts_arena_create(FEW, st);
    const ts_taps taps = arena ? ts_taps_triangle(arena, side, size) : (ts_taps){0};
    const cut c = {&photo, &taps, side, (photo.width - side) / 2, (photo.height - side) / 2};
    if (!taps.weight) code = ts_fail(st, TS_NOMEM, "no memory for the filter of %d to %d pixels", side, size);
    if (!code) code = io_image_create(square, size, size, 3, st);
    if (!code) code = resample(&photo, &c, threads, arena, square, st);
    if (code) {
        io_image_free(square);
        ts_context(st, "%s", path);
    }
    if (facts) {
        *facts = (io_photo_facts){.width = photo.width, .height = photo.height, .lens = photo.raw.lens};
        memcpy(facts->profile, photo.unread, sizeof facts->profile);
        facts->transparent = photo.transparent;
    }
    ts_arena_destroy(&arena);
    io_photo_close(&photo);
    return code;
}
