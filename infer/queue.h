/* A queue between threads. */
#ifndef LGD_QUEUE_H
#define LGD_QUEUE_H
#include <pthread.h>
#include <stdbool.h>

enum { LGD_QUEUE_MAX = 16 };
typedef struct lgd_queue {
    pthread_mutex_t lock;
    pthread_cond_t filled;
    void *item[LGD_QUEUE_MAX];
    int first, count;
    bool closed;
} lgd_queue;
#define LGD_QUEUE_INITIALIZER {.lock = PTHREAD_MUTEX_INITIALIZER, .filled = PTHREAD_COND_INITIALIZER}

/* Never waits: the caller sees to it that no more than LGD_QUEUE_MAX items exist. */
void lgd_queue_push(lgd_queue *q, void *item);
/* Waits for an item; false when there is none and the queue is closed. */
bool lgd_queue_pop(lgd_queue *q, void **item);
void lgd_queue_close(lgd_queue *q);
#endif
