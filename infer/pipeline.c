#include "infer/pipeline.h"
#include "infer/output.h"
#include "infer/photograph.h"
#include "infer/queue.h"
#include "tensor/threads.h"
#include <math.h>
#include <stdatomic.h>
#include <stdlib.h>
#include <string.h>

/* One item each in decoding, computing and writing. Where maps are large there is one in all: the memory counts more than the time. */
enum { ITEMS = 3, LARGE = 1024 };

struct lgd_pipeline {
    const lgd_plan *plan;
    const lgd_command *command;
    lgd_item item[ITEMS];
    lgd_queue idle, inbox, computed; /* inbox: for the computing thread; NULL there: no more is decoded */
    pthread_t decoder, writer;
    bool published, decoding, writing;
    atomic_bool stopped;
};

/* The mask is cut and resampled as the photograph is; what is not black in a pixel makes it wanted. */
static ts_code read_mask(const lgd_command *c, const io_image *photo, unsigned char **mask, ts_status *st)
{
    io_image whole = {0}, square = {0};
    const size_t pixels = (size_t)c->size * (size_t)c->size;
    ts_code code = io_read_data(c->mask, 1, c->max_pixels, &whole, st);
    if (code) return code;
    const double difference = (double)whole.width * photo->height - (double)whole.height * photo->width; /* a pixel of rounding is none */
    if (fabs(difference) > fmax(whole.width, whole.height) + fmax(photo->width, photo->height))
        code = ts_fail(st, TS_INVALID, "the mask %s is %d x %d pixels and the photograph %d x %d: not the same shape", c->mask, whole.width, whole.height, photo->width,
                       photo->height);
    if (!code) code = io_centre_square(&whole, c->size, &square, st);
    if (!code && !(*mask = malloc(pixels))) code = ts_fail(st, TS_NOMEM, "out of memory for the mask");
    for (size_t i = 0; i < pixels && !code; i++) (*mask)[i] = square.data[i] > 0;
    io_image_free(&whole);
    io_image_free(&square);
    return code;
}

static void decode_capture(const lgd_command *c, lgd_item *item)
{
    if (lgd_read_capture(c->capture, c->size, c->max_pixels, &item->capture, &item->st) != TS_OK) return;
    item->photo_side = c->size;
    if (io_image_create(&item->square, c->size, c->size, 3, &item->st) != TS_OK) ts_context(&item->st, "%s", c->capture);
    else memcpy(item->square.data, item->capture.image, (size_t)c->size * (size_t)c->size * 3 * sizeof(float));
}

static void decode(const lgd_command *c, bool published, lgd_item *item)
{
    if (*c->capture) {
        decode_capture(c, item);
        return;
    }
    io_image photo = {0};
    ts_code code = lgd_photograph_read(item->job->photo, published, c->max_pixels, &photo, &item->st);
    if (!code) {
        item->photo_side = photo.width < photo.height ? photo.width : photo.height;
        if (lgd_photograph_square(&photo, published, c->size, &item->square, &item->st) || (c->mask && read_mask(c, &photo, &item->mask, &item->st)))
            ts_context(&item->st, "%s", item->job->photo);
    }
    io_image_free(&photo);
}

static void *decode_all(void *user)
{
    lgd_pipeline *p = user;
    void *next;
    for (int i = 0; i < p->plan->jobs && lgd_queue_pop(&p->idle, &next) && !p->stopped; i++) {
        lgd_item *item = next;
        *item = (lgd_item){.job = &p->plan->job[i], .index = i, .decoded = true};
        decode(p->command, p->published, item);
        lgd_queue_push(&p->inbox, item);
    }
    lgd_queue_push(&p->inbox, NULL);
    return NULL;
}

static void *write_all(void *user)
{
    lgd_pipeline *p = user;
    const lgd_command *c = p->command;
    void *next;
    while (lgd_queue_pop(&p->computed, &next)) {
        lgd_item *item = next;
        /* The last one has all threads to itself: nothing is computed any more. */
        const int threads = item->index + 1 < p->plan->jobs && c->size <= LARGE ? 1 : ts_threads();
        lgd_photo first = lgd_flash_photo(item->square.data);
        if (item->capture.images) lgd_capture_photos(&item->capture, 1, &first);
        first.power *= (float)item->power;
        if (!item->st.code && lgd_output_write(c->out, item->job->stem, &item->m, &first, c->outputs, c->directx, threads, &item->lost, &item->st))
            ts_context(&item->st, "%s", item->job->photo);
        item->decoded = false;
        lgd_queue_push(&p->inbox, item);
    }
    return NULL;
}

lgd_pipeline *lgd_pipeline_start(const lgd_plan *plan, const lgd_command *command, bool published, ts_status *st)
{
    lgd_pipeline *p = calloc(1, sizeof *p);
    if (!p) return ts_fail(st, TS_NOMEM, "out of memory"), NULL;
    *p = (lgd_pipeline){.plan = plan, .command = command, .published = published, .idle = LGD_QUEUE_INITIALIZER, .inbox = LGD_QUEUE_INITIALIZER, .computed = LGD_QUEUE_INITIALIZER};
    for (int i = 0; i < (command->size > LARGE ? 1 : ITEMS); i++) lgd_queue_push(&p->idle, &p->item[i]);
    p->decoding = pthread_create(&p->decoder, NULL, decode_all, p) == 0;
    p->writing = p->decoding && pthread_create(&p->writer, NULL, write_all, p) == 0;
    if (!p->writing) {
        ts_fail(st, TS_NOMEM, "no more threads can be started here");
        lgd_pipeline_end(&p);
    }
    return p;
}

static void release(lgd_pipeline *p, lgd_item *item)
{
    io_image_free(&item->square);
    io_capture_free(&item->capture);
    io_material_free(&item->m);
    free(item->mask);
    item->mask = NULL;
    lgd_queue_push(&p->idle, item);
}

void lgd_pipeline_run(lgd_pipeline *p, lgd_compute compute, lgd_finished finished, bool (*stop)(void), void *user)
{
    bool more = true; /* is decoded */
    int under_way = 0;
    void *next;
    while ((more || under_way > 0) && lgd_queue_pop(&p->inbox, &next)) {
        lgd_item *item = next;
        if (!item) more = false;
        else if (item->decoded) {
            if (stop()) {
                p->stopped = true;
                ts_fail(&item->st, TS_INTERRUPTED, "interrupted");
            }
            if (!item->st.code) compute(item, user);
            under_way++;
            lgd_queue_push(&p->computed, item); /* a failed one too: results keep their order */
        } else {
            finished(item, user);
            under_way--;
            release(p, item);
        }
    }
}

void lgd_pipeline_end(lgd_pipeline **pp)
{
    lgd_pipeline *p = *pp;
    if (!p) return;
    p->stopped = true;
    lgd_queue_close(&p->idle);
    lgd_queue_close(&p->computed);
    if (p->decoding) pthread_join(p->decoder, NULL);
    if (p->writing) pthread_join(p->writer, NULL);
    for (int i = 0; i < ITEMS; i++) {
        io_image_free(&p->item[i].square);
        io_capture_free(&p->item[i].capture);
        io_material_free(&p->item[i].m);
        free(p->item[i].mask);
    }
    free(p);
    *pp = NULL;
}
