/* The foundation: status, arena, tensor views, random numbers, instruction sets, threads. */
#include "tensor/arena.h"
#include "tensor/cpu.h"
#include "tensor/memory.h"
#include "tensor/rng.h"
#include "tensor/scratch.h"
#include "tensor/tensor.h"
#include "tensor/threads.h"
#include "tests/test.h"
#include <math.h>
#include <pthread.h>
#include <stdlib.h>
#include <string.h>

TEST(blocks_are_aligned_whole_and_refused)
{
    static const size_t sizes[] = {
        1, 63, 64, 1000, 1u << 20, (3u << 20) + 5, (4u << 20) - 1, 4u << 20, (4u << 20) + 1, (9u << 20) + 17};
    for (size_t i = 0; i < sizeof sizes / sizeof *sizes; i++) {
        unsigned char *p = ts_memory(sizes[i]);
        CHECK(p && (uintptr_t)p % 64 == 0, "%zu bytes", sizes[i]);
        memset(p, 0x5a, sizes[i]); /* the sanitizer sees a block that is too short */
        ts_memory_fetch(p, sizes[i], 0);
        CHECK(p[0] == 0x5a && p[sizes[i] - 1] == 0x5a, "%zu bytes do not hold what was written", sizes[i]);
        free(p);
    }
    CHECK(!ts_memory(SIZE_MAX) && !ts_memory(SIZE_MAX - 100) && !ts_memory(SIZE_MAX / 2),
          "more than there is was given");
}

TEST(status_keeps_one_line_and_puts_context_first)
{
    ts_status st = {0};
    CHECK(ts_context(&st, "file") == TS_OK && st.message[0] == 0, "context on success must do nothing");
    ts_fail(&st, TS_FORMAT, "bad\nvalue %d", 7);
    ts_context(&st, "a\r/%s", "b\n.ini");
    CHECK(!strcmp(st.message, "a /b .ini: bad value 7") && st.code == TS_FORMAT, "got '%s'", st.message);
    char text[2000];
    memset(text, 'x', sizeof text - 1);
    text[sizeof text - 1] = 0;
    ts_fail(&st, TS_IO, "%s: no room", text);
    ts_context(&st, "a photograph: %s", text);
    CHECK(strlen(st.message) == sizeof st.message - 1, "a long message must be cut, got %zu", strlen(st.message));
    CHECK(!strncmp(st.message, "a photograph: x", 15) && strstr(st.message, "xxx ... xxx"), "got '%s'", st.message);
    CHECK(!strcmp(strchr(st.message, 0) - 10, "x: no room"), "the reason is cut off: '%s'", st.message);
    CHECK(ts_fail(NULL, TS_IO, "x") == TS_IO, "NULL status");
}

TEST(arena_aligns_grows_releases_and_merges)
{
    ts_arena *a = ts_arena_create(0, NULL);
    for (int round = 0; round < 3; round++) {
        unsigned char *p[200];
        for (int i = 0; i < 200; i++) {
            p[i] = ts_arena_alloc(a, (size_t)i * 1000);
            CHECK(p[i] && (uintptr_t)p[i] % 64 == 0, "allocation %d", i);
            memset(p[i], i, (size_t)i * 1000);
        }
        for (int i = 1; i < 200; i++) CHECK(p[i][0] == i && p[i][i * 1000 - 1] == i, "block %d was overwritten", i);
        const size_t used = ts_arena_used(a);
        const ts_mark mark = ts_arena_mark(a);
        void *q = ts_arena_alloc(a, 5 << 20);
        ts_arena_release(a, mark);
        CHECK(ts_arena_used(a) == used, "release gives back");
        CHECK(ts_arena_alloc(a, 5 << 20) == q, "released memory is used again");
        ts_arena_reset(a);
        CHECK(ts_arena_used(a) == 0, "reset");
        if (round % 2) {
            ts_arena_drop(a);
            CHECK(ts_arena_used(a) == 0 && ts_arena_peak(a) == 0, "drop");
        }
    }
    CHECK(ts_arena_alloc(a, SIZE_MAX / 2) == NULL, "too much memory gives NULL");
    CHECK(ts_arena_zalloc(a, SIZE_MAX / 2, 16) == NULL, "an overflowing product gives NULL");
    const float *z = ts_arena_zalloc(a, 100, sizeof(float));
    for (int i = 0; i < 100; i++) CHECK(z[i] == 0, "zalloc");
    ts_arena_destroy(&a);
    CHECK(a == NULL, "destroy nulls");
    ts_arena_destroy(&a);
}

TEST(arena_reserves_one_piece)
{
    enum { BLOCKS = 40, BYTES = 1 << 20 };
    ts_arena *a = ts_arena_create(0, NULL);
    ts_arena_reserve(a, SIZE_MAX / 2, 0); /* a hint that nothing can follow */
    unsigned char *first = ts_arena_alloc(a, BYTES);
    CHECK(first != NULL, "an arena without room for the hint");
    ts_arena_reserve(a, 2 * BLOCKS * BYTES, 0);
    CHECK(ts_arena_alloc(a, BYTES) == first + BYTES, "an arena that is not empty changes");
    ts_arena_reset(a);
    ts_arena_reserve(a, BLOCKS * BYTES, 0);
    first = ts_arena_alloc(a, BYTES);
    for (int i = 1; i < BLOCKS; i++)
        CHECK(ts_arena_alloc(a, BYTES) == first + (ptrdiff_t)i * BYTES, "block %d lies elsewhere", i);
    ts_arena_destroy(&a);
}

TEST(tensor_views_and_strided_copy)
{
    float data[2 * 3 * 4 * 5], out[2 * 2 * 2 * 3];
    for (int i = 0; i < 120; i++) data[i] = (float)i;
    ts_tensor t = ts_view(data, (ts_shape){2, 3, 4, 5});
    CHECK(ts_contiguous(&t), "a fresh view is contiguous");
    ts_tensor c = ts_window(&t, 1, 2, 2, 2);
    c.data += 1, c.shape.c = 3;
    CHECK(!ts_contiguous(&c), "a window of channels is not");
    ts_tensor d = ts_view(out, c.shape);
    ts_copy(&d, &c);
    int k = 0;
    for (int n = 0; n < 2; n++)
        for (int y = 1; y < 3; y++)
            for (int x = 2; x < 4; x++)
                for (int ch = 1; ch < 4; ch++, k++)
                    CHECK(out[k] == (float)(((n * 3 + y) * 4 + x) * 5 + ch), "value %d", k);
    ts_arena *a = ts_arena_create(0, NULL);
    CHECK(ts_new(a, (ts_shape){1, 0, 1, 1}).data == NULL, "an empty shape has no data");
    const int many = 1 << 16; /* 2^64 values, then as many bytes */
    CHECK(ts_new(a, (ts_shape){many, many, many, many}).data == NULL &&
              ts_new(a, (ts_shape){many, many, many, 1 << 14}).data == NULL,
          "more than there are addresses is given");
    ts_arena_destroy(&a);
}

TEST(rng_matches_philox_and_is_uniform)
{
    /* Known answers of Philox 4x32-10 published with Random123 (kat_vectors). */
    ts_rng zero = ts_rng_make(0, 0, 0);
    const uint32_t want[4] = {0x6627e8d5u, 0xe169c58du, 0xbc57ac4cu, 0x9b00dbd8u};
    for (int i = 0; i < 4; i++) CHECK(ts_rng_u32(&zero) == want[i], "word %d", i);
    ts_rng r = ts_rng_make(42, TS_STREAM_TEST, 7);
    double sum = 0, square = 0, nsum = 0, nsquare = 0;
    int bin[10] = {0};
    const int n = 200000;
    for (int i = 0; i < n; i++) {
        const float u = ts_rng_uniform(&r), g = ts_rng_normal(&r);
        CHECK(u >= 0 && u < 1, "uniform %g", u);
        sum += u;
        square += u * u;
        nsum += g;
        nsquare += g * g;
        bin[ts_rng_int(&r, 10)]++;
    }
    CHECK(fabs(sum / n - 0.5) < 0.004 && fabs(square / n - 1.0 / 3) < 0.004, "uniform moments %g %g", sum / n,
          square / n);
    CHECK(fabs(nsum / n) < 0.012 && fabs(nsquare / n - 1) < 0.02, "normal moments %g %g", nsum / n, nsquare / n);
    for (int i = 0; i < 10; i++) CHECK(abs(bin[i] - n / 10) < 700, "bin %d: %d", i, bin[i]);
    for (int i = 0; i < 100000; i++) {
        const float v = ts_rng_range(&r, 0.1f, 0.2f);
        CHECK(v >= 0.1f && v < 0.2f, "range %g", v);
    }
    ts_rng a = ts_rng_make(1, 2, 3), b = ts_rng_make(1, 2, 4), c = ts_rng_make(1, 3, 3);
    int same = 0;
    for (int i = 0; i < 100; i++) {
        const uint32_t x = ts_rng_u32(&a);
        same += (x == ts_rng_u32(&b)) + (x == ts_rng_u32(&c));
    }
    CHECK(same == 0, "streams coincide %d times", same);
}

TEST(cpu_refuses_what_is_not_there)
{
    ts_status st = {0};
    setenv("LGD_ISA", "sse9", 1);
    CHECK(ts_isa_init(&st) == TS_INVALID && strstr(st.message, "sse9") && strstr(st.message, "avx2"), "message '%s'",
          st.message);
    setenv("LGD_ISA", "base", 1);
    CHECK(ts_isa_init(&st) == TS_OK && ts_isa_now() == TS_BASE, "base is always there");
    for (int isa = TS_BASE; isa < TS_ISA_COUNT; isa++) {
        setenv("LGD_ISA", ts_isa_name((ts_isa)isa), 1);
        st = (ts_status){0};
        const bool there = isa <= (int)ts_isa_best();
        CHECK(ts_isa_init(&st) == (there ? TS_OK : TS_INVALID), "LGD_ISA=%s, and the CPU has %s: '%s'",
              ts_isa_name((ts_isa)isa), ts_isa_name(ts_isa_best()), st.message);
        CHECK(there || strstr(st.message, ts_isa_name((ts_isa)isa)), "the message '%s' does not name it", st.message);
    }
    unsetenv("LGD_ISA");
    CHECK(ts_isa_init(&st) == TS_OK && ts_isa_now() == ts_isa_best(), "unset: the best");
}

/* The tests of kernels go through the instruction sets that there are: a skip here says which of them did not run. */
static void kernels_run(ts_isa isa)
{
    if (isa > ts_isa_best())
        test_skip("no kernels for %s were tested: this CPU or build has %s", ts_isa_name(isa),
                  ts_isa_name(ts_isa_best()));
    ts_isa_use(isa);
    CHECK(ts_isa_now() == isa, "%s instead of %s", ts_isa_name(ts_isa_now()), ts_isa_name(isa));
}

TEST(cpu_has_avx2) { kernels_run(TS_AVX2); }
TEST(cpu_has_avx512) { kernels_run(TS_AVX512); }
TEST(cpu_has_avx512bf16) { kernels_run(TS_AVX512BF16); }
TEST(cpu_has_amx) { kernels_run(TS_AMX); }

static void *threads_seen(void *user)
{
    *(int *)user = ts_threads();
    return NULL;
}

TEST(threads_and_scratch)
{
    CHECK(ts_threads_allowed() >= 1, "allowed");
    ts_threads_set(3);
    CHECK(ts_threads() == 3, "set");
    ts_threads_set(0);
    CHECK(ts_threads() == ts_threads_allowed(), "default");
    unsetenv("OMP_NUM_THREADS"), unsetenv("OMP_THREAD_LIMIT");
    const int here = ts_threads_allowed();
    setenv("OMP_NUM_THREADS", "5,2", 1);
    CHECK(ts_threads_allowed() == 5, "OMP_NUM_THREADS=5,2: %d", ts_threads_allowed());
    setenv("OMP_THREAD_LIMIT", "3", 1);
    ts_threads_set(0);
    CHECK(ts_threads() == 3, "OMP_THREAD_LIMIT=3: %d", ts_threads());
    ts_threads_set(4);
    CHECK(ts_threads() == 4, "a number that is asked for is above the environment's: %d", ts_threads());
    unsetenv("OMP_THREAD_LIMIT");
    static const char *const none[] = {"0", "-1", "two", "2x", ","};
    for (int i = 0; i < 5; i++) {
        ts_status st = {0};
        setenv("OMP_NUM_THREADS", none[i], 1);
        CHECK(ts_threads_check(&st) == TS_INVALID && strstr(st.message, "OMP_NUM_THREADS") &&
                  ts_threads_allowed() == here,
              "OMP_NUM_THREADS=%s: %s", none[i], st.message);
    }
    setenv("OMP_NUM_THREADS", "", 1);
    CHECK(ts_threads_check(NULL) == TS_OK && ts_threads_allowed() == here, "an empty OMP_NUM_THREADS");
    unsetenv("OMP_NUM_THREADS");
    ts_threads_set(2);
    CHECK(ts_threads_of(5) == 5 && ts_threads_of(0) == 2, "a loop's own number, and the process's");
    pthread_t other;
    int seen = 0;
    CHECK(!pthread_create(&other, NULL, threads_seen, &seen) && !pthread_join(other, NULL) && seen == 2,
          "another thread uses %d", seen);
    ts_threads_set(0);
    unsigned char *a = ts_scratch(0, 1000), *b = ts_scratch(1, 1000);
    CHECK(a != b && (uintptr_t)a % 64 == 0, "slots are apart and aligned");
    memset(a, 1, 1000);
    memset(b, 2, 1000);
    CHECK(ts_scratch(0, 10) == a && a[999] == 1, "a smaller request keeps the memory");
    memset(ts_scratch(0, 1 << 20), 3, 1 << 20);
    CHECK(b[0] == 2 && b[999] == 2, "the other slot is untouched");
}
