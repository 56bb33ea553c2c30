#include "train/reduce.h"
#include "train/mpi/parts.h"
#include <stdlib.h>

ts_code tr_reducer_create(tr_reducer *r, const tr_mpi *mpi, nn_model *model, size_t bytes, tr_reduce how, ts_status *st)
{
    *r = (tr_reducer){.mpi = mpi, .model = model, .bytes = bytes, .how = how};
    r->bucket = calloc((size_t)model->params, sizeof *r->bucket);
    r->bucket_of = calloc((size_t)model->params, sizeof *r->bucket_of);
    return r->bucket && r->bucket_of ? TS_OK : ts_fail(st, TS_NOMEM, "no memory for %d buckets", model->params);
}

void tr_reducer_free(tr_reducer *r)
{
    free(r->bucket);
    free(r->bucket_of);
    *r = (tr_reducer){0};
}

static bool is_fixed(const nn_model *m, const nn_param *p)
{
    size_t first, last;
    for (int part = NN_G; part <= NN_COARSE; part++) {
        nn_model_range(m, (nn_part)part, &first, &last);
        if (p->offset >= first && p->offset < last) return m->fixed[part];
    }
    return false;
}

void tr_reduce_begin(tr_reducer *r)
{
    const nn_model *m = r->model;
    size_t end = m->count;
    r->count = r->sent = 0;
    r->status = (ts_status){0};
    bool open = false;
    for (int i = m->params; i-- > 0; end = m->param[i].offset) {
        r->bucket_of[i] = -1;
        if (is_fixed(m, &m->param[i])) {
            open = false;
            continue;
        }
        if (!open) r->bucket[r->count++] = (tr_bucket){.last = end};
        tr_bucket *b = &r->bucket[r->count - 1];
        r->bucket_of[i] = r->count - 1;
        b->first = m->param[i].offset;
        b->missing++;
        open = (b->last - b->first) * sizeof(float) < r->bytes;
    }
}

/* The first buckets of those that are left, as long as they are complete or all is to go. */
static void send(tr_reducer *r, bool all)
{
    for (; r->sent < r->count && !r->status.code && (all || r->bucket[r->sent].missing == 0); r->sent++) {
        const tr_bucket *b = &r->bucket[r->sent];
        r->mpi->begin_gradient(r->model->grad + b->first, b->last - b->first, r->how, &r->status);
    }
}

void tr_reduce_walked(float *const *grad, int count, void *user)
{
    tr_reducer *r = user;
    const nn_model *m = r->model;
    for (int i = 0; i < count; i++) {
        const size_t at = (size_t)(grad[i] - m->grad);
        int lo = 0, hi = m->params - 1; /* the parameter that begins there */
        while (lo < hi) {
            const int mid = (lo + hi + 1) / 2;
            if (m->param[mid].offset <= at) lo = mid;
            else hi = mid - 1;
        }
        if (r->bucket_of[lo] >= 0) r->bucket[r->bucket_of[lo]].missing--;
    }
    if (count > 0) send(r, false);
    r->mpi->poke();
}

ts_code tr_reduce_finish(tr_reducer *r, ts_status *st)
{
    send(r, true);
    if (r->status.code) {
        *st = r->status;
        return st->code;
    }
    r->mpi->complete();
    return TS_OK;
}

bool tr_reduce_own(const tr_reducer *r, int i, size_t *first, size_t *last)
{
    if (!r->parts) return i == 0;
    if (i >= r->count) return false;
    const tr_bucket *b = &r->bucket[i];
    const size_t count = b->last - b->first, from = b->first + tr_part(count, r->parts, r->part),
                 to = b->first + tr_part(count, r->parts, r->part + 1);
    if (*first < from) *first = from;
    if (*last > to) *last = to;
    if (*last < *first) *last = *first;
    return true;
}
