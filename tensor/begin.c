#include "tensor/begin.h"
#include <errno.h>
#include <sched.h>
#include <stdlib.h>

typedef struct beginning {
    void *(*run)(void *);
    void *user;
    cpu_set_t all;
} beginning;

static void *begin(void *p)
{
    const beginning b = *(beginning *)p;
    free(p);
    sched_setaffinity(0, sizeof b.all, &b.all); /* of this thread; it stays where it is until the system moves it */
    return b.run(b.user);
}

static int begin_elsewhere(pthread_t *thread, const pthread_attr_t *attr, int here, beginning *b)
{
    pthread_attr_t own;
    int detached = PTHREAD_CREATE_JOINABLE, error = attr ? pthread_attr_getdetachstate(attr, &detached) : 0;
    cpu_set_t others = b->all;
    CPU_CLR(here, &others);
    if (error || (error = pthread_attr_init(&own))) return error;
    pthread_attr_setdetachstate(&own, detached);
    error = pthread_attr_setaffinity_np(&own, sizeof others, &others);
    if (!error) error = pthread_create(thread, &own, begin, b);
    pthread_attr_destroy(&own);
    return error;
}

int ts_begin_thread(pthread_t *thread, const pthread_attr_t *attr, void *(*run)(void *), void *user)
{
    const int here = sched_getcpu();
    beginning *b = malloc(sizeof *b);
    int error = EINVAL;
    if (b) {
        *b = (beginning){.run = run, .user = user};
        if (here >= 0 && sched_getaffinity(0, sizeof b->all, &b->all) == 0 && CPU_COUNT(&b->all) > 1)
            error = begin_elsewhere(thread, attr, here, b);
        if (error) free(b);
    }
    /* There is no other CPU, or it was taken away meanwhile, or there are more than a mask of ours holds. */
    return error == EINVAL ? pthread_create(thread, attr, run, user) : error;
}
