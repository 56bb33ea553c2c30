/* What data/image/runs.h compresses, zlib inflates to the same bytes. */
#include "data/image/runs.h"
#include "tensor/rng.h"
#include "tests/test.h"
#include <stdlib.h>
#include <string.h>
#include <zlib.h>

/* In portions of at most step bytes; returns the stream's size. */
static size_t round_trip(const unsigned char *data, size_t size, size_t step, const char *what)
{
    const size_t calls = size / step + 1, most = calls * io_runs_most(step) + io_runs_most(0);
    unsigned char *packed = malloc(most), *back = malloc(size + 1);
    CHECK(packed && back, "out of memory");
    io_runs r = {0};
    size_t n = 0, at = 0;
    do {
        const size_t part = size - at < step ? size - at : step, room = io_runs_most(part);
        packed[n + room - 1] = 0x5a;
        const size_t written = io_runs_put(&r, data + at, part, at + part == size, packed + n);
        CHECK(written <= room, "%s: %zu bytes of %zu, %zu are allowed", what, written, part, room);
        n += written;
        at += part;
    } while (at < size);
    uLongf length = (uLongf)(size + 1);
    const int code = uncompress(back, &length, packed, (uLong)n);
    CHECK(code == Z_OK && length == size && memcmp(back, data, size) == 0,
          "%s, %zu bytes in portions of %zu: zlib says %d, %zu bytes", what, size, step, code, (size_t)length);
    free(packed);
    free(back);
    return n;
}

enum { KINDS = 7, MOST = 3 * IO_RUNS_BLOCK + 777 };
static const char *const names[KINDS] = {
    "noise", "zeros", "few values", "runs of all lengths", "a few of most", "like filtered rows", "two values"};

static void fill(int kind, unsigned char *to, size_t size)
{
    ts_rng rng = ts_rng_make(5, TS_STREAM_TEST, (uint64_t)kind);
    int a = 1, b = 1;
    for (size_t i = 0, run = 1; i < size; i++) {
        switch (kind) {
        case 0: to[i] = (unsigned char)ts_rng_int(&rng, 256); break;
        case 1: to[i] = 0; break;
        case 2: to[i] = (unsigned char)(ts_rng_int(&rng, 4) * 60); break;
        case 3: /* 1, 2, ... 700 bytes, of values in turn */
            to[i] = (unsigned char)a;
            if (++b > (int)run) run = run % 700 + 1, a++, b = 1;
            break;
        case 4: { /* each half as often as the one before: Huffman's codes would be too long */
            int k = 0;
            while (k < 40 && ts_rng_int(&rng, 2)) k++;
            to[i] = (unsigned char)k;
            break;
        }
        case 5: to[i] = (unsigned char)(ts_rng_int(&rng, 6) + ts_rng_int(&rng, 6) - 5); break;
        default: to[i] = (unsigned char)(ts_rng_int(&rng, 50) == 0);
        }
    }
}

TEST(runs_inflate_to_what_they_were)
{
    static const size_t sizes[] = {0, 1, 2, 3, 4, 5, 7, 8, 9, 63, 258, 259, 260, 261, 262, 1000, 65536, MOST};
    unsigned char *data = malloc(MOST);
    for (int kind = 0; kind < KINDS; kind++) {
        fill(kind, data, MOST);
        for (size_t s = 0; s < sizeof sizes / sizeof *sizes; s++) {
            round_trip(data, sizes[s], MOST, names[kind]);
            round_trip(data, sizes[s], sizes[s] > 2000 ? 5001 : 3, names[kind]);
            if (sizes[s] < MOST) round_trip(data + 1, sizes[s], IO_RUNS_BLOCK, names[kind]);
        }
    }
    free(data);
}

TEST(runs_of_every_length_and_place)
{
    unsigned char data[700];
    for (int length = 1; length <= 600; length += length < 20 || (length > 250 && length < 270) ? 1 : 37)
        for (int at = 0; at < 9; at++) {
            for (int i = 0; i < 700; i++) data[i] = (unsigned char)(i * 7 + i / 256);
            memset(data + at, 9, (size_t)length);
            round_trip(data, 700, 700, "one run");
            round_trip(data, (size_t)(at + length), 700, "a run at the end");
        }
}

TEST(runs_are_as_small_as_their_entropy)
{
    unsigned char *data = malloc(MOST);
    fill(1, data, MOST);
    CHECK(round_trip(data, MOST, MOST, "zeros") < MOST / 200, "zeros stay large");
    fill(2, data, MOST);
    const size_t n = round_trip(data, MOST, MOST, "four values");
    CHECK(n < MOST / 8 * 2.25 + 400, "four values, 2 bits each, one of them 3 for the end: %zu bytes of %d", n, MOST);
    fill(0, data, MOST);
    CHECK(round_trip(data, MOST, MOST, "noise") < MOST * 1.02, "noise grows");
    free(data);
}
