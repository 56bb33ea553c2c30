/* XXH64 against numbers that its authors' program prints, from memory and from files of every kind of length. */
#include "tensor/hash.h"
#include "tests/support/files.h"
#include "tests/test.h"
#include <stdlib.h>

TEST(hash_is_xxh64)
{
    static const struct {
        const char *text;
        size_t size;
        uint64_t hash;
    } known[] = {{"", 0, 0xef46db3751d8e999u},
                 {"a", 1, 0xd24ec4f1a98c6e5bu},
                 {"abc", 3, 0x44bc2cf5ad770999u},
                 {"Call me Ishmael. Some years ago--never mind how long precisely-", 63, 0x02a2e85470d6fd96u}};
    for (size_t i = 0; i < sizeof known / sizeof *known; i++)
        CHECK(ts_hash(known[i].text, known[i].size, 0) == known[i].hash, "'%s'", known[i].text);
    CHECK(ts_hash("abc", 3, 1) != ts_hash("abc", 3, 0), "the seed changes nothing");
}

TEST(hash_of_a_file_is_that_of_its_bytes)
{
    enum { MOST = (1 << 19) + 100 };
    static const size_t sizes[] = {0, 1, 31, 32, 33, (1 << 18) - 1, 1 << 18, (1 << 18) + 1, (1 << 19) + 40};
    unsigned char *bytes = malloc(MOST);
    char path[4096];
    ts_status st = {0};
    uint64_t h = 0;
    CHECK(bytes, "out of memory");
    for (size_t i = 0; i < MOST; i++) bytes[i] = (unsigned char)(i * i >> 7 ^ i);
    snprintf(path, sizeof path, "%s/f", test_folder());
    for (size_t i = 0; i < sizeof sizes / sizeof *sizes; i++) {
        spill(path, bytes, sizes[i]);
        CHECK(ts_hash_file(path, &h, &st) == TS_OK, "%s", st.message);
        CHECK(h == ts_hash(bytes, sizes[i], 0), "%zu bytes", sizes[i]);
    }
    free(bytes);
    CHECK(ts_hash_file(test_folder(), &h, &st) == TS_UNSUPPORTED && st.message[0], "a folder has a hash");
}
