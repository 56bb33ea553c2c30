/* The safetensors reader: every way in which a file can be something else than it claims. */
#include "nn/weights/weights.h"
#include "tests/support/files.h"
#include "tests/test.h"
#include <math.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

/* A file of that header and of bytes of values. */
static const char *craft(const char *header, size_t bytes)
{
    const char *path = path_of("bad.safetensors");
    uint64_t size = strlen(header);
    char *all = calloc(1, 8 + size + bytes + 1);
    memcpy(all, &size, 8);
    memcpy(all + 8, header, size);
    spill(path, all, 8 + size + bytes);
    free(all);
    return path;
}

/* Refused, with one line that names the file and says what. */
static void refused(const char *path, const char *what)
{
    ts_status st = {0};
    nn_file *f = nn_safetensors_open(path, &st);
    CHECK(!f, "a file that should say '%s' is taken", what);
    CHECK(st.code == TS_FORMAT || st.code == TS_IO, "code %d for '%s'", st.code, what);
    CHECK(strstr(st.message, path) == st.message, "'%s' does not begin with the file's name", st.message);
    CHECK(strstr(st.message, what), "'%s' does not say '%s'", st.message, what);
    CHECK(!strchr(st.message, '\n'), "more than a line: '%s'", st.message);
}

TEST(safetensors_malformed_files_are_refused)
{
#define T(shape, from, to) "{\"dtype\":\"F32\",\"shape\":" shape ",\"data_offsets\":[" from "," to "]}"
    static const struct {
        const char *header;
        size_t bytes;
        const char *what;
    } bad[] = {
        {"{\"a\":" T("[2]", "0", "8") "}", 4, "outside the file"},
        {"{\"a\":" T("[2]", "8", "16") "}", 16, "hole"},
        {"{\"a\":" T("[2]", "0", "8") ",\"b\":" T("[2]", "12", "20") "}", 20, "\"b\" comes after a hole"},
        {"{\"a\":" T("[2]", "0", "8") ",\"b\":" T("[2]", "4", "12") "}", 12, "\"b\" overlaps"},
        {"{\"a\":" T("[2]", "0", "8") ",\"b\":" T("[2]", "0", "8") "}", 8, "overlaps"},
        {"{\"a\":" T("[2]", "0", "8") ",\"a\":" T("[2]", "8", "16") "}", 16, "\"a\" is there twice"},
        {"{\"a\":" T("[2]", "0", "8") "}", 9, "1 bytes follow"},
        {"{\"a\":" T("[3]", "0", "8") "}", 8, "\"a\" has 8 bytes, its shape needs 12"},
        {"{\"a\":" T("[2]", "8", "0") "}", 8, "outside the file"},
        {"{\"a\":" T("[4294967296,4294967296,16]", "0", "0") "}", 0, "\"a\" has an impossible shape"},
        {"{\"a\":" T("[2305843009213693952,2]", "0", "0") "}", 0, "impossible shape"},
        {"{\"a\":" T("[4611686018427387904]", "0", "0") "}", 0, "impossible shape"},
        {"{\"a\":" T("[1]", "9223372036854775804", "9223372036854775807") "}", 0, "outside the file"},
        {"{\"a\":" T("[1]", "0", "99999999999999999999") "}", 0, "too large"},
        {"{\"a\":" T("[-1]", "0", "4") "}", 4, "not negative"},
        {"{\"a\":" T("[1.0]", "0", "4") "}", 4, "not negative"},
        {"{\"a\":" T("[01]", "0", "4") "}", 4, "begins with 0"},
        {"{\"a\":" T("[1e0]", "0", "4") "}", 4, "not negative"},
        {"{\"a\":" T("[1,1,1,1,1,1,1,1,1]", "0", "4") "}", 4, "more than 8 dimensions"},
        {"{\"a\":" T("\"1\"", "0", "4") "}", 4, "expected '['"},
        {"{\"a\":" T("[1]", "0,4", "4") "}", 4, "expected ']'"},
        {"{\"a\":{\"dtype\":\"F33\",\"shape\":[1],\"data_offsets\":[0,4]}}", 4, "\"a\" has the unknown dtype \"F33\""},
        {"{\"a\":{\"shape\":[1],\"data_offsets\":[0,4]}}", 4, "\"a\" lacks"},
        {"{\"a\":{\"dtype\":\"F32\",\"shape\":[1],\"shape\":[1],\"data_offsets\":[0,4]}}", 4,
         "\"a\" has the unknown or repeated key \"shape\""},
        {"{\"a\":{\"dtype\":\"F32\",\"shape\":[1],\"data_offsets\":[0,4],\"code\":\"x\"}}", 4,
         "unknown or repeated key \"code\""},
        {"{\"a\":[[[[[[[[[[[[[[[[[[[[", 0, "expected '{'"},
        {"{\"a\":{\"dtype\":{\"dtype\":{}}}}", 0, "expected a string"},
        {"[]", 0, "expected '{'"},
        {"null", 0, "expected '{'"},
        {"", 0, "expected '{'"},
        {"{", 0, "expected a string"},
        {"{\"a\"}", 0, "expected ':'"},
        {"{\"a\":" T("[1]", "0", "4") ",}", 4, "expected a string"},
        {"{\"a\":" T("[1]", "0", "4") "} x", 4, "follows the end"},
        {"{\"\xc3\x28\":" T("[1]", "0", "4") "}", 4, "UTF-8"},
        {"{\"\xc0\x80\":" T("[1]", "0", "4") "}", 4, "UTF-8"},
        {"{\"\xed\xa0\x80\":" T("[1]", "0", "4") "}", 4, "UTF-8"},
        {"{\"\xf4\x90\x80\x80\":" T("[1]", "0", "4") "}", 4, "UTF-8"},
        {"{\"a\n\":" T("[1]", "0", "4") "}", 4, "control character"},
        {"{\"\\u0000\":" T("[1]", "0", "4") "}", 4, "character 0"},
        {"{\"\\ud800x\":" T("[1]", "0", "4") "}", 4, "surrogate"},
        {"{\"\\u12g4\":" T("[1]", "0", "4") "}", 4, "hexadecimal"},
        {"{\"\\x\":" T("[1]", "0", "4") "}", 4, "escape"},
        {"{\"a", 0, "does not end"},
        {"{\"a\\", 0, "escape"},
        {"{\"a\\u12", 0, "hexadecimal"},
        {"{\"a\xe2\x82", 0, "UTF-8"},
        {"{\"__metadata__\":{\"k\":1}}", 0, "expected a string"},
        {"{\"__metadata__\":{\"k\":\"1\",\"k\":\"2\"}}", 0, "metadata key \"k\" is there twice"},
        {"{\"__metadata__\":{},\"__metadata__\":{}}", 0, "second __metadata__"},
        {"{\"__metadata__\":{\"k\":{\"l\":{}}}}", 0, "expected a string"},
    };
    for (size_t i = 0; i < sizeof bad / sizeof *bad; i++) refused(craft(bad[i].header, bad[i].bytes), bad[i].what);
    ts_status st = {0};
    nn_file *f = nn_safetensors_open(
        craft("{ \"a\" : {\"shape\":[ 1 , 1 ],\n\"data_offsets\":[0,4],\"dtype\":\"F32\"} , \"b\":" T("[0]", "4",
                                                                                                      "4") "}   ",
              4),
        &st);
    CHECK(f && nn_file_count(f) == 2, "a good file: %s", st.message);
    nn_file_close(&f);
    f = nn_safetensors_open(craft("{}", 0), &st);
    CHECK(f && nn_file_count(f) == 0 && !nn_file_has(f, "a"), "an empty list: %s", st.message);
    nn_file_close(&f);
#undef T
}

TEST(safetensors_impossible_headers_are_refused)
{
    const char *path = path_of("h.safetensors");
    char few[16] = {0};
    spill(path, few, 0);
    refused(path, "empty");
    spill(path, few, 7);
    refused(path, "no safetensors file");
    spill(path, few, 8);
    refused(path, "expected '{'");
    static const uint64_t sizes[] = {9, 100u << 20, (16u << 20) + 1, UINT64_MAX, UINT64_MAX - 7, INT64_MAX};
    for (int i = 0; i < 6; i++) {
        memcpy(few, &sizes[i], 8);
        spill(path, few, 16);
        refused(path, i ? "at most 16 MiB" : "truncated");
    }
    size_t big = 100u << 20; /* really there */
    char *header = malloc(big + 8);
    uint64_t size = big;
    memcpy(header, &size, 8);
    memset(header + 8, ' ', big);
    spill(path, header, big + 8);
    refused(path, "at most 16 MiB");
    size = 16 << 20; /* a deep nest of the largest size that is read */
    memcpy(header, &size, 8);
    memset(header + 8, '[', 16 << 20);
    spill(path, header, (16 << 20) + 8);
    refused(path, "expected '{'");
    memcpy(header + 8, "{\"a\":", 5);
    memset(header + 13, '{', (16 << 20) - 5);
    spill(path, header, (16 << 20) + 8);
    refused(path, "expected a string");
    unlink(path);
    free(header);
    refused(test_folder(), "not a regular file");
    refused(path_of("none"), "No such file");
    mkfifo(path, 0600);
    refused(path, "not a regular file");
}

TEST(safetensors_half_precision_is_exact)
{
    static const uint16_t half[] = {0x0000, 0x8000, 0x3c00, 0xc000, 0x0001, 0x8001,
                                    0x03ff, 0x0400, 0x7bff, 0x7c00, 0xfc00, 0x3555};
    static const float value[] = {0.0f,         -0.0f,    1,     -2,       0x1p-24f,  -0x1p-24f,
                                  0x1.ff8p-15f, 0x1p-14f, 65504, INFINITY, -INFINITY, 0x1.554p-2f};
    static const uint16_t brain[] = {0x3f80, 0xc040, 0x0000, 0x7f7f};
    static const float brain_value[] = {1, -3, 0, 0x1.fep+127f};
    char bytes[600] = {0};
    const char *header = "{\"h\":{\"dtype\":\"F16\",\"shape\":[12],\"data_offsets\":[0,24]},\"b\":{\"dtype\":\"BF16\","
                         "\"shape\":[4],\"data_offsets\":[24,32]},"
                         "\"i\":{\"dtype\":\"I64\",\"shape\":[1],\"data_offsets\":[32,40]}}";
    uint64_t n = strlen(header);
    memcpy(bytes, &n, 8);
    memcpy(bytes + 8, header, n);
    memcpy(bytes + 8 + n, half, sizeof half);
    memcpy(bytes + 8 + n + 24, brain, sizeof brain);
    const char *path = path_of("half.safetensors");
    spill(path, bytes, 8 + n + 40);
    ts_status st = {0};
    nn_file *f = nn_safetensors_open(path, &st);
    CHECK(f, "%s", st.message);
    float out[12];
    CHECK(!nn_file_read(f, "h", 1, (int64_t[]){12}, out, &st), "%s", st.message);
    CHECK(!memcmp(out, value, sizeof value), "F16 is read wrongly");
    CHECK(!nn_file_read(f, "b", 1, (int64_t[]){4}, out, &st), "%s", st.message);
    CHECK(!memcmp(out, brain_value, sizeof brain_value), "BF16 is read wrongly");
    CHECK(nn_file_read(f, "i", 1, (int64_t[]){1}, out, &st) == TS_FORMAT && strstr(st.message, "\"i\" has dtype I64"),
          "'%s'", st.message);
    CHECK(nn_file_read(f, "b", 2, (int64_t[]){2, 2}, out, &st) == TS_FORMAT && strstr(st.message, "[4], not [2, 2]"),
          "'%s'", st.message);
    CHECK(nn_file_read(f, "c", 1, (int64_t[]){4}, out, &st) == TS_FORMAT && strstr(st.message, "\"c\" is missing"),
          "'%s'", st.message);
    nn_file_close(&f);
}

/* Every half that there is comes back from its float; halves between two floats go to the nearest, ties to the even
 * one. */
TEST(file_numbers_are_rounded_to_nearest_even)
{
    uint16_t *half = malloc(65536 * 2), *back = malloc(65536 * 2);
    float *f = malloc(65536 * 4);
    for (int i = 0; i < 65536; i++) half[i] = (uint16_t)i;
    nn_tensor e = {"x", NN_F16, false, 1, {65536}, {1}, 65536, (const unsigned char *)half}, g = e;
    g.dtype = NN_F32, g.data = (const unsigned char *)f;
    for (int b = 0; b < 2; b++) {
        nn_dtype type = b ? NN_BF16 : NN_F16;
        e.dtype = type;
        CHECK(nn_tensor_copy(&e, NN_F32, f) && nn_tensor_copy(&g, type, back), "an overflow");
        for (int i = 0; i < 65536; i++)
            CHECK(back[i] == half[i] || (isnan(f[i]) && b ? (back[i] | 0x40) == (half[i] | 0x40) : isnan(f[i])),
                  "%04x -> %04x", half[i], back[i]);
        for (int i = 1; i < (b ? 0x7f7f : 0x7bff); i++) { /* halfway to the next, and a little to both sides */
            float middle = (float)(((double)f[i] + f[i + 1]) / 2),
                  three[3] = {nextafterf(middle, 0), middle, nextafterf(middle, INFINITY)};
            uint16_t got[3];
            nn_tensor m = {"m", NN_F32, false, 1, {3}, {1}, 3, (const unsigned char *)three};
            CHECK(nn_tensor_copy(&m, type, got), "an overflow");
            if (fabsf(f[i]) < 1e-36f) continue; /* bfloat16 subnormals: the middle itself is rounded */
            CHECK(got[0] == i && got[1] == i + (i & 1) && got[2] == i + 1, "%s %04x: %04x %04x %04x",
                  nn_dtype_name(type), i, got[0], got[1], got[2]);
        }
    }
    float large[] = {65519.996f, 65520};
    nn_tensor l = {"l", NN_F32, false, 1, {1}, {1}, 1, (const unsigned char *)large};
    CHECK(nn_tensor_copy(&l, NN_F16, back) && back[0] == 0x7bff, "65519.996 -> %04x", back[0]);
    l.data += 4;
    CHECK(!nn_tensor_copy(&l, NN_F16, back), "65520 fits a half");
}

/* Strides, byte orders and types against the definition. */
TEST(file_numbers_with_any_layout)
{
    double wide[48];
    unsigned char swapped[48 * 8];
    for (int i = 0; i < 48; i++) {
        wide[i] = i + 0.25;
        for (int j = 0; j < 8; j++) swapped[8 * i + j] = ((unsigned char *)&wide[i])[7 - j];
    }
    static const struct {
        int rank;
        int64_t dim[4], stride[4];
        bool plain;
    } c[] = {{3, {2, 3, 4}, {12, 4, 1}, true},
             {3, {4, 3, 2}, {1, 4, 12}, false},
             {2, {3, 4}, {8, 2}, false},
             {2, {5, 3}, {0, 1}, false},
             {0, {0}, {0}, true},
             {4, {1, 3, 1, 4}, {99, 4, 7, 1}, true},
             {4, {2, 2, 2, 2}, {1, 16, 2, 8}, false},
             {2, {0, 4}, {4, 1}, true},
             {1, {1}, {5}, true},
             {3, {2, 3, 4}, {24, 4, 1}, false}};
    for (size_t k = 0; k < sizeof c / sizeof *c; k++)
        for (int order = 0; order < 2; order++) {
            nn_tensor e = {"x", NN_F64, order, c[k].rank, {0}, {0}, 1, order ? swapped : (unsigned char *)wide};
            int64_t at[4] = {0}, n = 0;
            for (int i = 0; i < e.rank; i++) {
                e.dim[i] = c[k].dim[i];
                e.stride[i] = c[k].stride[i];
                e.count *= e.dim[i];
            }
            float out[64];
            double as_is[64];
            CHECK(nn_tensor_plain(&e) == (c[k].plain && (!order || !e.count)), "case %zu: plain", k);
            CHECK(nn_tensor_copy(&e, NN_F32, out) && nn_tensor_copy(&e, NN_F64, as_is), "an overflow");
            for (; n < e.count; n++) {
                int64_t from = 0;
                for (int i = 0; i < e.rank; i++) from += at[i] * e.stride[i];
                CHECK(out[n] == (float)wide[from] && as_is[n] == wide[from], "case %zu, number %lld: %g, not %g", k,
                      (long long)n, out[n], wide[from]);
                for (int i = e.rank - 1; i >= 0 && ++at[i] == e.dim[i]; i--) at[i] = 0;
            }
        }
}
