/* How a thread of tensor/team.c waits for a word of memory: it spins, then it sleeps in the kernel. */
#ifndef TS_WAIT_H
#define TS_WAIT_H
#include <linux/futex.h>
#include <stdatomic.h>
#include <stdbool.h>
#include <sys/syscall.h>
#include <time.h>
#include <unistd.h>

/* Sleeps while *word is value; may return early. */
static inline void futex_wait(atomic_uint *word, unsigned value)
{
    syscall(SYS_futex, word, FUTEX_WAIT_PRIVATE, value, NULL, NULL, 0);
}

/* Wakes one that sleeps. */
static inline void futex_wake(atomic_uint *word) { syscall(SYS_futex, word, FUTEX_WAKE_PRIVATE, 1, NULL, NULL, 0); }

static inline long long nanoseconds(void)
{
    struct timespec t;
    clock_gettime(CLOCK_MONOTONIC, &t);
    return (long long)t.tv_sec * 1000000000 + t.tv_nsec;
}

static inline void pause_briefly(void)
{
#if defined(__x86_64__) || defined(__i386__)
    __builtin_ia32_pause();
#elif defined(__aarch64__)
    __asm__ volatile("isb" ::: "memory"); /* yield does nothing on most cores */
#endif
}

enum { LOOKS = 32 }; /* between two at the clock */
#define SPIN 50e-6   /* seconds: longer than from loop to loop in a network, shorter than a time slice */

/* Until (*word & mask) == value where equal, or != value where not. False when it has taken too long. */
static inline bool spin(const atomic_uint *word, unsigned mask, unsigned value, bool equal)
{
    for (long long end = 0;;) {
        for (int i = 0; i < LOOKS; i++) {
            if (((atomic_load_explicit(word, memory_order_acquire) & mask) == value) == equal) return true;
            pause_briefly();
        }
        const long long now = nanoseconds();
        if (!end) end = now + (long long)(SPIN * 1e9);
        if (now > end) return false;
    }
}
#endif
