#include "infer/queue.h"

void lgd_queue_push(lgd_queue *q, void *item)
{
    pthread_mutex_lock(&q->lock);
    q->item[(q->first + q->count++) % LGD_QUEUE_MAX] = item;
    pthread_cond_signal(&q->filled);
    pthread_mutex_unlock(&q->lock);
}

bool lgd_queue_pop(lgd_queue *q, void **item)
{
    pthread_mutex_lock(&q->lock);
    while (q->count == 0 && !q->closed) pthread_cond_wait(&q->filled, &q->lock);
    const bool found = q->count > 0;
    if (found) {
        *item = q->item[q->first];
        q->first = (q->first + 1) % LGD_QUEUE_MAX;
        q->count--;
    }
    pthread_mutex_unlock(&q->lock);
    return found;
}

void lgd_queue_close(lgd_queue *q)
{
    pthread_mutex_lock(&q->lock);
    q->closed = true;
    pthread_cond_broadcast(&q->filled);
    pthread_mutex_unlock(&q->lock);
}
