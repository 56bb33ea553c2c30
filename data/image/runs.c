#include "data/image/runs.h"
#include <libdeflate.h>
#include <stdlib.h>
#include <string.h>

enum {
    END = 256,            /* symbols: bytes, the block's end, runs by their lengths */
    SYMBOLS = 286,        /* of which a run of 258 has the last */
    LENGTHS = 19,         /* symbols that say codes' lengths: 0 to 15, the last again, zeros, more zeros */
    MOST_BITS = 12,       /* of a symbol: those of four fit into the writer's 64 bits behind seven others */
    MOST_LENGTH_BITS = 7, /* of a symbol that says lengths */
    RUN_LEAST = 8,        /* fewer are smaller as single bytes, where those are frequent */
    RUN_MOST = 258,
    RUN_SHORTEST = 3, /* that a symbol can say */
    HEADER = 512      /* bytes of a block's codes, and of what a stream begins and ends with, at most */
};

typedef struct code {
    uint16_t bits; /* as they are written: the first is the lowest */
    uint8_t length;
} code;

typedef struct writer {
    uint64_t bits;
    int count;
    unsigned char *to;
} writer;

/* Bytes [begin, end) of the block are all that of begin - 1. */
typedef struct run {
    size_t begin, end;
} run;

static inline void put(writer *w, uint32_t bits, int count)
{
    w->bits |= (uint64_t)bits << w->count;
    w->count += count;
}

/* Of the 56 bits and more that there may be less than 8 are left. */
static inline void flush(writer *w)
{
    for (int i = 0; i < 8; i++) w->to[i] = (unsigned char)(w->bits >> (8 * i)); /* one store */
    w->to += w->count >> 3;
    w->bits >>= w->count & ~7;
    w->count &= 7;
}

static inline void put_code(writer *w, code c) { put(w, c.bits, c.length); }

/* The symbol of a run of 3 to 258 bytes, and the bits that follow it. */
static int symbol_of(int length, int *extra, int *extra_bits)
{
    *extra = *extra_bits = 0;
    if (length == RUN_MOST) return SYMBOLS - 1;
    const int over = length - RUN_SHORTEST;
    if (over < 8) return END + 1 + over;
    const int bits = 29 - __builtin_clz((unsigned)over); /* four symbols for each number of bits */
    *extra_bits = bits;
    *extra = over & ((1 << bits) - 1);
    return END + 1 + 4 * bits + (over >> bits);
}

/* What a run is written as: parts of up to 258 bytes; a rest of less than three as single bytes. */
static int next_part(size_t left) { return left >= RUN_MOST ? RUN_MOST : left >= RUN_SHORTEST ? (int)left : 0; }

static uint32_t take32(const unsigned char *p)
{
    uint32_t v;
    memcpy(&v, p, sizeof v);
    return v;
}

/* The first run of RUN_LEAST bytes or more that begins at *from or later; it holds four bytes from a multiple of four
 * on. *from becomes where the next may begin. False: there is none. */
static bool next_run(const unsigned char *p, size_t size, size_t *from, run *r)
{
    const size_t least = *from > 1 ? *from : 1;
    for (size_t i = (least + 3) & ~(size_t)3; i + 4 <= size; i += 4) {
        if (take32(p + i) != take32(p + i - 1)) continue;
        size_t begin = i, end = i + 4;
        while (begin > least && p[begin - 1] == p[begin - 2]) begin--;
        while (end + 4 <= size && take32(p + end) == take32(p + end - 1)) end += 4;
        while (end < size && p[end] == p[end - 1]) end++;
        if (end - begin < RUN_LEAST) continue;
        *r = (run){begin, end};
        *from = end + 1; /* the byte at end is another */
        return true;
    }
    return false;
}

/* How often the bytes are there, in turn in four tables: one that was just counted need not be waited for. */
static void count_bytes(const unsigned char *p, size_t size, uint32_t often[4][256])
{
    size_t i = 0;
    for (; i + 4 <= size; i += 4)
        for (int k = 0; k < 4; k++) often[k][p[i + k]]++;
    for (; i < size; i++) often[0][p[i]]++;
}

static void count_symbols(const unsigned char *p, size_t size, uint32_t often[SYMBOLS])
{
    uint32_t bytes[4][256] = {{0}};
    size_t at = 0, from = 0;
    memset(often, 0, SYMBOLS * sizeof *often);
    for (run r; next_run(p, size, &from, &r);) {
        count_bytes(p + at, r.begin - at, bytes);
        size_t left = r.end - r.begin;
        for (int part; (part = next_part(left)); left -= (size_t)part) {
            int extra, extra_bits;
            often[symbol_of(part, &extra, &extra_bits)]++;
        }
        at = r.end - left;
    }
    count_bytes(p + at, size - at, bytes);
    for (int i = 0; i < 256; i++) often[i] = bytes[0][i] + bytes[1][i] + bytes[2][i] + bytes[3][i];
    often[END] = 1;
    if (size == 0) often[0] = 1; /* no reader minds a code of two symbols */
}

typedef struct leaf {
    uint32_t often;
    int symbol;
} leaf;

static int by_often(const void *a, const void *b)
{
    const leaf *x = a, *y = b;
    return x->often != y->often ? (x->often > y->often ? 1 : -1) : x->symbol - y->symbol;
}

/* How many of n >= 2 leaves, sorted by how often they are there, have which depth in Huffman's tree: number[depth], up
 * to most. */
static void depths(const leaf *leaves, int n, int most, int number[MOST_BITS + 1])
{
    uint32_t weight[SYMBOLS];
    int parent[2 * SYMBOLS],
        depth[2 * SYMBOLS]; /* the leaves, then the inner nodes in the order in which they are made */
    memset(number, 0, (MOST_BITS + 1) * sizeof *number);
    for (int made = 0, leaf_at = 0, inner_at = 0; made < n - 1; made++) {
        weight[made] = 0;
        for (int k = 0; k < 2; k++) {
            const bool is_leaf = inner_at == made || (leaf_at < n && leaves[leaf_at].often <= weight[inner_at]);
            weight[made] += is_leaf ? leaves[leaf_at].often : weight[inner_at];
            parent[is_leaf ? leaf_at++ : n + inner_at++] = n + made;
        }
    }
    depth[2 * n - 2] = 0;
    for (int i = 2 * n - 3; i >= 0; i--) {
        depth[i] = depth[parent[i]] + 1;
        if (i < n) number[depth[i] < most ? depth[i] : most]++;
    }
    /* Where some were too deep there is no room for all at most: one goes beside another that is less deep, until there
     * is. */
    int room = -(1 << most);
    for (int d = 1; d <= most; d++) room += number[d] << (most - d);
    for (; room > 0; room--) {
        int d = most - 1;
        while (!number[d]) d--;
        number[most]--;
        number[d]--;
        number[d + 1] += 2;
    }
}

static uint16_t reversed(unsigned bits, int count)
{
    unsigned r = 0;
    for (int i = 0; i < count; i++) r |= (bits >> i & 1) << (count - 1 - i);
    return (uint16_t)r;
}

/* The canonical code, of at most so many bits, for symbols of which at least two are there. */
static void make_code(const uint32_t *often, int symbols, int most, code *codes)
{
    leaf leaves[SYMBOLS];
    int n = 0, number[MOST_BITS + 1];
    for (int i = 0; i < symbols; i++) {
        codes[i] = (code){0};
        if (often[i]) leaves[n++] = (leaf){often[i], i};
    }
    qsort(leaves, (size_t)n, sizeof *leaves, by_often);
    depths(leaves, n, most, number);
    for (int d = most, i = 0; d > 0; d--)
        for (int k = 0; k < number[d]; k++) codes[leaves[i++].symbol].length = (uint8_t)d;
    unsigned next[MOST_BITS + 1] = {0};
    for (int d = 2; d <= most; d++) next[d] = (next[d - 1] + (unsigned)number[d - 1]) << 1;
    for (int i = 0; i < symbols; i++)
        if (codes[i].length) codes[i].bits = reversed(next[codes[i].length]++, codes[i].length);
}

/* The lengths of the codes as symbols of their own, each with what follows it; returns how many. */
static int say_lengths(const code *codes, int symbols, unsigned char said[SYMBOLS + 1],
                       unsigned char extra[SYMBOLS + 1])
{
    enum { AGAIN = 16, ZEROS = 17, MANY_ZEROS = 18 };
    int n = 0;
    for (int i = 0, same; i <= symbols; i += same) { /* the last is of runs' distances: 1 */
        const int length = i < symbols ? codes[i].length : 1;
        for (same = 1; i + same <= symbols && (i + same < symbols ? codes[i + same].length : 1) == length;) same++;
        if (length == 0 && same >= 3) {
            if (same > 138) same = 138;
            said[n] = same >= 11 ? MANY_ZEROS : ZEROS;
            extra[n++] = (unsigned char)(same - (same >= 11 ? 11 : 3));
        } else {
            said[n] = (unsigned char)length;
            extra[n++] = 0;
            if (same > 7) same = 7;
            if (length > 0 && same >= 4) {
                said[n] = AGAIN;
                extra[n++] = (unsigned char)(same - 4);
            } else same = 1;
        }
    }
    return n;
}

static void put_codes(writer *w, const code *codes)
{
    static const unsigned char order[LENGTHS] = {16, 17, 18, 0, 8, 7, 9, 6, 10, 5, 11, 4, 12, 3, 13, 2, 14, 1, 15};
    static const unsigned char extra_bits[LENGTHS] = {[16] = 2, [17] = 3, [18] = 7};
    unsigned char said[SYMBOLS + 1], extra[SYMBOLS + 1];
    uint32_t often[LENGTHS] = {0};
    code lengths[LENGTHS];
    int symbols = SYMBOLS, orders = LENGTHS;
    while (!codes[symbols - 1].length) symbols--; /* END has one */
    const int n = say_lengths(codes, symbols, said, extra);
    for (int i = 0; i < n; i++) often[said[i]]++;
    make_code(often, LENGTHS, MOST_LENGTH_BITS, lengths);
    while (orders > 4 && !lengths[order[orders - 1]].length) orders--;
    put(w, (uint32_t)(symbols - END - 1), 5);
    put(w, 0, 5); /* one distance */
    put(w, (uint32_t)(orders - 4), 4);
    for (int i = 0; i < orders; i++) {
        put(w, lengths[order[i]].length, 3);
        flush(w);
    }
    for (int i = 0; i < n; i++) {
        put_code(w, lengths[said[i]]);
        put(w, extra[i], extra_bits[said[i]]);
        flush(w);
    }
}

static void put_bytes(writer *to, const unsigned char *p, size_t size, const code *codes)
{
    writer w = *to;
    for (; size >= 4; p += 4, size -= 4) {
        for (int k = 0; k < 4; k++) put_code(&w, codes[p[k]]);
        flush(&w);
    }
    for (; size > 0; p++, size--) put_code(&w, codes[*p]);
    flush(&w);
    *to = w;
}

static void put_block(writer *w, const unsigned char *p, size_t size, bool last)
{
    enum { DYNAMIC = 2 };
    uint32_t often[SYMBOLS];
    code codes[SYMBOLS];
    count_symbols(p, size, often);
    make_code(often, SYMBOLS, MOST_BITS, codes);
    put(w, last, 1);
    put(w, DYNAMIC, 2);
    put_codes(w, codes);
    size_t at = 0, from = 0;
    for (run r; next_run(p, size, &from, &r);) {
        put_bytes(w, p + at, r.begin - at, codes);
        size_t left = r.end - r.begin;
        for (int part; (part = next_part(left)); left -= (size_t)part) {
            int extra, extra_bits;
            put_code(w, codes[symbol_of(part, &extra, &extra_bits)]);
            put(w, (uint32_t)extra, extra_bits);
            put(w, 0, 1); /* the distance, 1 */
            flush(w);
        }
        at = r.end - left;
    }
    put_bytes(w, p + at, size - at, codes);
    put_code(w, codes[END]);
    flush(w);
}

size_t io_runs_most(size_t size) { return (size * MOST_BITS + 7) / 8 + (size / IO_RUNS_BLOCK + 2) * HEADER; }

size_t io_runs_put(io_runs *r, const unsigned char *data, size_t size, bool last, unsigned char *to)
{
    writer w = {r->bits, r->count, to};
    if (!r->begun) {
        put(&w, 0x0178, 16); /* deflate, a window of 32 KiB, the fastest level */
        flush(&w);
        r->begun = true;
        r->sum = libdeflate_adler32(0, NULL, 0);
    }
    r->sum = libdeflate_adler32(r->sum, data, size);
    do {
        const size_t part = size < IO_RUNS_BLOCK ? size : IO_RUNS_BLOCK;
        if (part || last) put_block(&w, data, part, last && part == size);
        data += part;
        size -= part;
    } while (size > 0);
    if (last) {
        w.count = (w.count + 7) & ~7;
        put(&w, __builtin_bswap32(r->sum), 32);
        flush(&w);
    }
    r->bits = w.bits;
    r->count = w.count;
    return (size_t)(w.to - to);
}
