#include "cli/infer/pipeline.h"
#include "cli/cli.h"
#include "tensor/begin.h"
#include "tensor/budget.h"
#include "tensor/threads.h"
#include <pthread.h>
#include <stdlib.h>

/* Threads that wait for each other between the loops of one small photograph do less than as many that each have one of
 * their own. Of large ones there is one in all: the memory counts more than the time. While maps are written a thread
 * waits for the disk: another takes its place. */
enum { LANES = 8, AHEAD = 2, WRITING = 1, LARGE = 1024 };

enum { IDLE, DECODING, DECODED, COMPUTING, FINISHED }; /* an item's stages */

struct cl_pipeline {
    const cl_plan *plan;
    const cl_command *command;
    const char *read_recipe, *recipe; /* of reading: NULL where nothing may be complete already */
    lgd_model *model;
    const cl_listener *listener;
    pthread_t decoder;
    bool published, decoding;
    int lanes, items;     /* photographs that are computed at once, and in all */
    int writing;          /* threads more than lanes */
    pthread_mutex_t lock; /* of what follows */
    pthread_cond_t changed;
    cl_item item[LANES + AHEAD + WRITING];
    int begun, computed, reported; /* decodings, items that are computed now, and those that are reported */
    bool all_begun, stopped;
};

/* The first in the plan's order; NULL: there is none. */
static cl_item *first_at(cl_pipeline *p, int stage)
{
    cl_item *first = NULL;
    for (int i = 0; i < p->items; i++)
        if (p->item[i].stage == stage && (!first || p->item[i].index < first->index)) first = &p->item[i];
    return first;
}

static void move(cl_pipeline *p, cl_item *item, int stage)
{
    pthread_mutex_lock(&p->lock);
    item->stage = stage;
    pthread_cond_broadcast(&p->changed);
    pthread_mutex_unlock(&p->lock);
}

static void end_early(cl_pipeline *p)
{
    pthread_mutex_lock(&p->lock);
    p->stopped = true;
    pthread_cond_broadcast(&p->changed);
    pthread_mutex_unlock(&p->lock);
}

/* For the next photograph; NULL: there is none, or no more are wanted. */
static cl_item *begin_decoding(cl_pipeline *p)
{
    cl_item *item = NULL;
    pthread_mutex_lock(&p->lock);
    while (p->begun < p->plan->jobs && !p->stopped && !(item = first_at(p, IDLE)))
        pthread_cond_wait(&p->changed, &p->lock);
    if (item) {
        *item = (cl_item){.m = item->m,
                          .job = &p->plan->job[p->begun],
                          .index = p->begun,
                          .stage = DECODING,
                          .threads = p->plan->jobs > 1 ? 1 : 0}; /* of several the others have work */
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
    cl_pipeline *p = user;
    cl_item *item;
    while ((item = begin_decoding(p))) {
        const double start = cl_seconds();
        cl_item_read(p->command, p->read_recipe, p->published, item);
        item->seconds = cl_seconds() - start;
        move(p, item, DECODED);
    }
    return NULL;
}

/* The threads are dealt anew for every round of the lanes: the last may have fewer photographs. */
static int threads_for(const cl_pipeline *p, int index)
{
    const int left = p->plan->jobs - index / p->lanes * p->lanes, at_once = left < p->lanes ? left : p->lanes;
    return ts_threads() > at_once ? ts_threads() / at_once : 1;
}

/* From decoded to finished. A failed one too: results keep their order. */
static void work_on(cl_pipeline *p, cl_item *item)
{
    item->threads = threads_for(p, item->index);
    const cl_listener *l = p->listener;
    const double start = cl_seconds();
    if (l->stop()) end_early(p);
    else if (!item->st.code && !item->was_done) cl_item_estimate(p->command, p->model, item, l->progress, l->user);
    pthread_mutex_lock(&p->lock);
    p->computed--;
    pthread_cond_broadcast(&p->changed);
    pthread_mutex_unlock(&p->lock);
    if (l->stop()) item->st = (ts_status){.code = TS_INTERRUPTED, .message = "interrupted"};
    if (!item->st.code && !item->was_done) cl_item_write(p->command, p->recipe, item);
    item->seconds += cl_seconds() - start;
    move(p, item, FINISHED);
}

/* What the calling thread does next: an item to work on, or where it reports, the next to be reported. NULL: nothing is
 * left. */
static cl_item *next(cl_pipeline *p, bool reports)
{
    cl_item *item = NULL;
    pthread_mutex_lock(&p->lock);
    for (;;) {
        cl_item *finished = reports ? first_at(p, FINISHED) : NULL;
        if (finished && finished->index == p->reported) {
            p->reported++;
            item = finished;
            break;
        }
        if (p->computed < p->lanes && (item = first_at(p, DECODED))) {
            item->stage = COMPUTING;
            p->computed++;
            break;
        }
        const bool none = !first_at(p, DECODING) && !first_at(p, DECODED); /* to come, or to be waited for */
        if (p->all_begun && (reports ? p->reported == p->begun : none)) break;
        pthread_cond_wait(&p->changed, &p->lock);
    }
    pthread_mutex_unlock(&p->lock);
    return item;
}

static void *lane(void *user)
{
    cl_pipeline *p = user;
    cl_item *item;
    while ((item = next(p, false))) work_on(p, item);
    return NULL;
}

/* Photographs that are computed at once: one for each thread, and fewer where the memory would not do. */
static int most_at_once(int jobs, int size)
{
    const double each = 64e6 + 200.0 * size * size; /* bytes, of a shipped model more than were seen */
    int lanes = jobs < LANES ? jobs : LANES;
    if (lanes > ts_threads()) lanes = ts_threads();
    while (lanes > 1 && ts_budget_check(lanes * each, NULL) != TS_OK) lanes--;
    return lanes;
}

cl_pipeline *cl_pipeline_start(const cl_plan *plan, const cl_command *command, const char *recipe, bool published,
                               ts_status *st)
{
    cl_pipeline *p = calloc(1, sizeof *p);
    if (!p) return ts_fail(st, TS_NOMEM, "out of memory"), NULL;
    *p = (cl_pipeline){.plan = plan,
                       .command = command,
                       .read_recipe = recipe,
                       .published = published,
                       .lock = PTHREAD_MUTEX_INITIALIZER,
                       .changed = PTHREAD_COND_INITIALIZER,
                       .lanes = 1,
                       .items = 1};
    if (command->size <= LARGE) {
        p->lanes = most_at_once(plan->jobs, command->size);
        p->writing = plan->jobs > p->lanes ? WRITING : 0;
        p->items = p->lanes + AHEAD + p->writing;
    }
    p->decoding = ts_begin_thread(&p->decoder, NULL, decode_all, p) == 0;
    if (!p->decoding) {
        ts_fail(st, TS_NOMEM, "no more threads can be started here");
        cl_pipeline_end(&p);
    }
    return p;
}

void cl_pipeline_run(cl_pipeline *p, lgd_model *model, const char *recipe, const cl_listener *listener)
{
    pthread_t other[LANES + WRITING];
    cl_item *item;
    int others = 0;
    p->model = model;
    p->recipe = recipe;
    p->listener = listener;
    const double each = cl_item_bytes(p->command, model);
    while (p->lanes > 1 && ts_budget_check(p->lanes * each, NULL) != TS_OK) p->lanes--;
    while (others < p->lanes + p->writing - 1 && ts_begin_thread(&other[others], NULL, lane, p) == 0)
        others++; /* fewer do the same work */
    while ((item = next(p, true))) {
        if (item->stage == FINISHED) {
            listener->finished(item, listener->user);
            cl_item_clear(item);
            move(p, item, IDLE);
        } else work_on(p, item);
    }
    for (int i = 0; i < others; i++) pthread_join(other[i], NULL);
}

void cl_pipeline_end(cl_pipeline **pp)
{
    cl_pipeline *p = *pp;
    if (!p) return;
    end_early(p);
    if (p->decoding) pthread_join(p->decoder, NULL);
    for (int i = 0; i < p->items; i++) cl_item_free(&p->item[i]);
    pthread_cond_destroy(&p->changed);
    pthread_mutex_destroy(&p->lock);
    free(p);
    *pp = NULL;
}
