/* Threads that begin where there is time for them. */
#ifndef TS_BEGIN_H
#define TS_BEGIN_H
#include <pthread.h>

/* As pthread_create, but the thread begins on another CPU than the calling thread's where the process may use one, and
 * may go to any of them afterwards. attr: NULL, or the caller's, of which it takes whether the thread is detached, no
 * more. Left to itself Linux often puts a new thread on its creator's CPU, behind it: in a virtual machine it takes
 * CPUs that sleep for ones whose host has given them to others. The thread then waits until its creator sleeps or has
 * used up its time slice. */
int ts_begin_thread(pthread_t *thread, const pthread_attr_t *attr, void *(*run)(void *), void *user);
#endif
