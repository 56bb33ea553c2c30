#include "tensor/hash.h"
#include <errno.h>
#include <fcntl.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

/* The primes of the algorithm's description. */
static const uint64_t p1 = 0x9E3779B185EBCA87u, p2 = 0xC2B2AE3D27D4EB4Fu, p3 = 0x165667B19E3779F9u,
                      p4 = 0x85EBCA77C2B2AE63u, p5 = 0x27D4EB2F165667C5u;

enum { LANES = 4, STRIPE = 8 * LANES };

typedef struct state {
    uint64_t lane[LANES], seed, total;
} state;

static uint64_t rotate_left(uint64_t v, int bits) { return v << bits | v >> (64 - bits); }

static uint64_t take64(const unsigned char *p)
{
    uint64_t v = 0;
    for (int i = 0; i < 8; i++) v |= (uint64_t)p[i] << (8 * i); /* little-endian: one load */
    return v;
}

static uint64_t take32(const unsigned char *p)
{
    return p[0] | (uint64_t)p[1] << 8 | (uint64_t)p[2] << 16 | (uint64_t)p[3] << 24;
}

static uint64_t mix(uint64_t lane, uint64_t input) { return rotate_left(lane + input * p2, 31) * p1; }

static state begin(uint64_t seed) { return (state){{seed + p1 + p2, seed + p2, seed, seed - p1}, seed, 0}; }

/* size: whole stripes. */
static void stripes(state *s, const unsigned char *p, size_t size)
{
    for (const unsigned char *end = p + size; p < end; p += STRIPE)
        for (int i = 0; i < LANES; i++) s->lane[i] = mix(s->lane[i], take64(p + 8 * i));
    s->total += size;
}

/* rest: less than a stripe. */
static uint64_t end(const state *s, const unsigned char *p, size_t rest)
{
    uint64_t h = s->seed + p5;
    if (s->total) {
        h = rotate_left(s->lane[0], 1) + rotate_left(s->lane[1], 7) + rotate_left(s->lane[2], 12) +
            rotate_left(s->lane[3], 18);
        for (int i = 0; i < LANES; i++) h = (h ^ mix(0, s->lane[i])) * p1 + p4;
    }
    h += s->total + rest;
    for (; rest >= 8; p += 8, rest -= 8) h = rotate_left(h ^ mix(0, take64(p)), 27) * p1 + p4;
    if (rest >= 4) h = rotate_left(h ^ take32(p) * p1, 23) * p2 + p3, p += 4, rest -= 4;
    for (; rest > 0; p++, rest--) h = rotate_left(h ^ *p * p5, 11) * p1;
    h = (h ^ h >> 33) * p2;
    h = (h ^ h >> 29) * p3;
    return h ^ h >> 32;
}

uint64_t ts_hash(const void *data, size_t size, uint64_t seed)
{
    state s = begin(seed);
    const size_t whole = size / STRIPE * STRIPE;
    stripes(&s, data, whole);
    return end(&s, (const unsigned char *)data + whole, size - whole);
}

/* As much as there is, up to size; -1 and errno. */
static ssize_t fill(int fd, unsigned char *buffer, size_t size)
{
    size_t have = 0;
    while (have < size) {
        const ssize_t n = read(fd, buffer + have, size - have);
        if (n < 0 && errno == EINTR) continue;
        if (n < 0) return -1;
        if (n == 0) break;
        have += (size_t)n;
    }
    return (ssize_t)have;
}

ts_code ts_hash_file(const char *path, uint64_t *hash, ts_status *st)
{
    enum { PORTION = 1 << 18 }; /* whole stripes */
    const int fd = open(path, O_RDONLY | O_NONBLOCK | O_CLOEXEC);
    if (fd < 0) return ts_fail(st, TS_IO, "%s: cannot be read: %s", path, strerror(errno));
    struct stat info;
    if (fstat(fd, &info) != 0) {
        ts_fail(st, TS_IO, "%s: cannot be read: %s", path, strerror(errno));
        close(fd);
        return TS_IO;
    }
    if (!S_ISREG(info.st_mode)) { /* what is read from a pipe is gone */
        close(fd);
        return ts_fail(st, TS_UNSUPPORTED, "%s: is no regular file", path);
    }
    unsigned char *buffer = malloc(PORTION);
    state s = begin(0);
    ssize_t n = 0;
    while (buffer && (n = fill(fd, buffer, PORTION)) == PORTION) stripes(&s, buffer, PORTION);
    ts_code code = TS_OK;
    if (!buffer) code = ts_fail(st, TS_NOMEM, "%s: out of memory", path);
    else if (n < 0) code = ts_fail(st, TS_IO, "%s: cannot be read: %s", path, strerror(errno));
    else {
        const size_t whole = (size_t)n / STRIPE * STRIPE;
        stripes(&s, buffer, whole);
        *hash = end(&s, buffer + whole, (size_t)n - whole);
    }
    free(buffer);
    close(fd);
    return code;
}
