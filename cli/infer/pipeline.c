#include "cli/infer/pipeline.h"
#include "infer/memory.h"
#include "infer/output.h"
#include "infer/photograph.h"
#include "tensor/threads.h"
#include <math.h>
#include <pthread.h>
#include <stdlib.h>
#include <string.h>

/* Threads that wait for each other between the loops of one small photograph do less than as many that each have one of
 * their own. Of large ones there is one in all: the memory counts more than the time. */
enum { LANES = 8, AHEAD = 2, LARGE = 1024 };

enum { IDLE, DECODING, DECODED, COMPUTING, FINISHED }; /* an item's stages */

struct lgd_pipeline {
    const lgd_plan *plan;
    const lgd_command *command;
    lgd_compute compute;
    bool (*stop)(void);
    void *user;
    pthread_t decoder;
    bool published, decoding;
    int lanes, items;     /* photographs that are computed at once, and in all */
    pthread_mutex_t lock; /* of what follows */
    pthread_cond_t changed;
    lgd_item item[LANES + AHEAD];
    int begun, told; /* decodings, and items that are told of */
    bool all_begun, stopped;
};

/* The mask is cut and resampled as the photograph is; what is not black in a pixel makes it wanted. */
static ts_code read_mask(const lgd_command *c, int width, int height, unsigned char **mask, ts_status *st)
{
    io_image whole = {0}, square = {0};
    const size_t pixels = (size_t)c->size * (size_t)c->size;
    ts_code code = io_read_data(c->mask, 1, c->max_pixels, &whole, st);
    if (code) return code;
    const double difference = (double)whole.width * height -
        (double)whole.height * width; /* a pixel of rounding is none */
    if (fabs(difference) > fmax(whole.width, whole.height) + fmax(width, height))
        code = ts_fail(st, TS_INVALID, "the mask %s is %d x %d pixels and the photograph %d x %d: not the same shape",
                       c->mask, whole.width, whole.height, width, height);
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
    if (io_image_create(&item->square, c->size, c->size, 3, &item->st) != TS_OK)
        ts_context(&item->st, "%s", c->capture);
    else memcpy(item->square.data, item->capture.image, (size_t)c->size * (size_t)c->size * 3 * sizeof(float));
}

static void decode(const lgd_command *c, bool published, int threads, lgd_item *item)
{
    if (*c->capture) {
        decode_capture(c, item);
        return;
    }
    int width, height;
    if (lgd_photograph_square(item->job->photo, published, c->max_pixels, c->size, threads, &item->square, &width,
                              &height, &item->st))
        return;
    item->photo_side = width < height ? width : height;
    if (c->mask && read_mask(c, width, height, &item->mask, &item->st)) ts_context(&item->st, "%s", item->job->photo);
}

/* The first in the plan's order; NULL: there is none. */
static lgd_item *first_at(lgd_pipeline *p, int stage)
{
    lgd_item *first = NULL;
    for (int i = 0; i < p->items; i++)
        if (p->item[i].stage == stage && (!first || p->item[i].index < first->index)) first = &p->item[i];
    return first;
}

static void move(lgd_pipeline *p, lgd_item *item, int stage)
{
    pthread_mutex_lock(&p->lock);
    item->stage = stage;
    pthread_cond_broadcast(&p->changed);
    pthread_mutex_unlock(&p->lock);
}

static void end_early(lgd_pipeline *p)
{
    pthread_mutex_lock(&p->lock);
    p->stopped = true;
    pthread_cond_broadcast(&p->changed);
    pthread_mutex_unlock(&p->lock);
}

/* For the next photograph; NULL: there is none, or no more are wanted. */
static lgd_item *begin_decoding(lgd_pipeline *p)
{
    lgd_item *item = NULL;
    pthread_mutex_lock(&p->lock);
    while (p->begun < p->plan->jobs && !p->stopped && !(item = first_at(p, IDLE)))
        pthread_cond_wait(&p->changed, &p->lock);
    if (item) {
        *item = (lgd_item){.job = &p->plan->job[p->begun], .index = p->begun, .stage = DECODING};
        p->begun++;
    } else {
        p->all_begun = true;
        pthread_cond_broadcast(&p->changed);
    }
    pthread_mutex_unlock(&p->lock);
    return item;
}

static void *decode_all(void *user)
{
    lgd_pipeline *p = user;
    lgd_item *item;
    while ((item = begin_decoding(p))) {
        decode(p->command, p->published, p->plan->jobs > 1 ? 1 : 0, item); /* of several the others have work */
        move(p, item, DECODED);
    }
    return NULL;
}

/* The threads are dealt anew for every round of the lanes: the last may have fewer photographs. */
static int threads_for(const lgd_pipeline *p, int index)
{
    const int left = p->plan->jobs - index / p->lanes * p->lanes, at_once = left < p->lanes ? left : p->lanes;
    return ts_threads() > at_once ? ts_threads() / at_once : 1;
}

static void write_files(const lgd_command *c, lgd_item *item)
{
    lgd_photo first = lgd_flash_photo(item->square.data);
    if (item->capture.images) lgd_capture_photos(&item->capture, 1, &first);
    first.power *= (float)item->power;
    if (lgd_output_write(c->out, item->job->stem, &item->m, &first, c->outputs, c->directx, item->threads, &item->lost,
                         &item->st))
        ts_context(&item->st, "%s", item->job->photo);
}

/* From decoded to finished. A failed one too: results keep their order. */
static void work_on(lgd_pipeline *p, lgd_item *item)
{
    item->threads = threads_for(p, item->index);
    if (p->stop()) {
        end_early(p);
        ts_fail(&item->st, TS_INTERRUPTED, "interrupted");
    }
    if (!item->st.code) p->compute(item, p->user);
    if (!item->st.code) write_files(p->command, item);
    move(p, item, FINISHED);
}

/* What the calling thread does next: an item to work on, or where it tells, the next to be told of. NULL: nothing is
 * left. */
static lgd_item *next(lgd_pipeline *p, bool tells)
{
    lgd_item *item = NULL;
    pthread_mutex_lock(&p->lock);
    for (;;) {
        lgd_item *finished = tells ? first_at(p, FINISHED) : NULL;
        if (finished && finished->index == p->told) {
            p->told++;
            item = finished;
            break;
        }
        if ((item = first_at(p, DECODED))) {
            item->stage = COMPUTING;
            break;
        }
        if (p->all_begun && (tells ? p->told == p->begun : !first_at(p, DECODING))) break;
        pthread_cond_wait(&p->changed, &p->lock);
    }
    pthread_mutex_unlock(&p->lock);
    return item;
}

static void *lane(void *user)
{
    lgd_pipeline *p = user;
    lgd_item *item;
    while ((item = next(p, false))) work_on(p, item);
    return NULL;
}

/* Photographs that are computed at once: one for each thread, and fewer where the memory would not do. */
static int most_at_once(int jobs, int size)
{
    const double each = 64e6 + 200.0 * size * size; /* bytes, more than were seen */
    ts_status full = {0};
    int lanes = jobs < LANES ? jobs : LANES;
    if (lanes > ts_threads()) lanes = ts_threads();
    while (lanes > 1 && lgd_memory_check(lanes * each, &full) != TS_OK) lanes--;
    return lanes;
}

lgd_pipeline *lgd_pipeline_start(const lgd_plan *plan, const lgd_command *command, bool published, ts_status *st)
{
    lgd_pipeline *p = calloc(1, sizeof *p);
    if (!p) return ts_fail(st, TS_NOMEM, "out of memory"), NULL;
    *p = (lgd_pipeline){.plan = plan,
                        .command = command,
                        .published = published,
                        .lock = PTHREAD_MUTEX_INITIALIZER,
                        .changed = PTHREAD_COND_INITIALIZER,
                        .lanes = 1,
                        .items = 1};
    if (command->size <= LARGE) {
        p->lanes = most_at_once(plan->jobs, command->size);
        p->items = p->lanes + AHEAD;
    }
    p->decoding = pthread_create(&p->decoder, NULL, decode_all, p) == 0;
    if (!p->decoding) {
        ts_fail(st, TS_NOMEM, "no more threads can be started here");
        lgd_pipeline_end(&p);
    }
    return p;
}

static void release(lgd_item *item)
{
    io_image_free(&item->square);
    io_capture_free(&item->capture);
    io_material_free(&item->m);
    free(item->mask);
    item->mask = NULL;
}

void lgd_pipeline_run(lgd_pipeline *p, lgd_compute compute, lgd_finished finished, bool (*stop)(void), void *user)
{
    pthread_t other[LANES];
    lgd_item *item;
    int others = 0;
    p->compute = compute;
    p->stop = stop;
    p->user = user;
    while (others < p->lanes - 1 && pthread_create(&other[others], NULL, lane, p) == 0)
        others++; /* fewer do the same work */
    while ((item = next(p, true))) {
        if (item->stage == FINISHED) {
            finished(item, user);
            release(item);
            move(p, item, IDLE);
        } else work_on(p, item);
    }
    for (int i = 0; i < others; i++) pthread_join(other[i], NULL);
}

void lgd_pipeline_end(lgd_pipeline **pp)
{
    lgd_pipeline *p = *pp;
    if (!p) return;
    end_early(p);
    if (p->decoding) pthread_join(p->decoder, NULL);
    for (int i = 0; i < p->items; i++) release(&p->item[i]);
    pthread_cond_destroy(&p->changed);
    pthread_mutex_destroy(&p->lock);
    free(p);
    *pp = NULL;
}
