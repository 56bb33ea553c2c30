/* zlib streams (RFC 1950, RFC 1951) of single bytes and of runs of one byte, in blocks that each have Huffman codes of
 * their own. In the filtered rows of photographs and maps other matches are rare: what looks for them takes five times
 * as long and makes maps no smaller, renderings by 2 to 4%. */
#ifndef IO_RUNS_H
#define IO_RUNS_H
#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

enum { IO_RUNS_BLOCK = 96 << 10 }; /* bytes that have codes of their own */

/* A stream between two calls; all zeros before the first. */
typedef struct io_runs {
    uint64_t bits; /* count < 8 of them, that are still to be written */
    int count;
    bool begun;
    uint32_t sum; /* Adler's, of all bytes */
} io_runs;

/* Bytes that the next call writes and touches, at most. */
size_t io_runs_most(size_t size);
/* The next bytes of the stream, of any number, to to; last: and its end. Returns how many bytes were written. */
size_t io_runs_put(io_runs *r, const unsigned char *data, size_t size, bool last, unsigned char *to);
#endif
