/* Replays the inputs of tests/corpus: each reader meets what once was of use to its fuzzer (make fuzz), or broke it. */
#include "tests/fuzz/fuzz.h"
#include "tests/test.h"
#include <dirent.h>
#include <stdlib.h>
#include <string.h>

static void replay(const char *name, void (*f)(const uint8_t *data, size_t size), int least)
{
    char path[1024];
    int count = 0;
    snprintf(path, sizeof path, "tests/corpus/%s", name);
    DIR *folder = opendir(path);
    CHECK(folder, "%s cannot be read", path);
    fuzz_where = test_folder();
    for (struct dirent *d; (d = readdir(folder));) {
        if (d->d_name[0] == '.') continue;
        snprintf(path, sizeof path, "tests/corpus/%s/%s", name, d->d_name);
        FILE *file = fopen(path, "rb");
        uint8_t *data = malloc(1 << 20);
        CHECK(file && data, "%s cannot be read", path);
        const size_t size = fread(data, 1, 1 << 20, file);
        fclose(file);
        f(data, size); /* a crash ends this test, which the runner reports */
        free(data);
        count++;
    }
    closedir(folder);
    CHECK(count >= least, "only %d inputs in tests/corpus/%s", count, name);
}

TEST(corpus_safetensors) { replay("safetensors", fuzz_safetensors, 5); }
TEST(corpus_torch) { replay("torch", fuzz_torch, 100); }
TEST(corpus_photo) { replay("photo", fuzz_photo, 8); }
TEST(corpus_image) { replay("image", fuzz_image, 5); }
TEST(corpus_config) { replay("config", fuzz_config, 3); }
TEST(corpus_folder) { replay("folder", fuzz_folder, 6); }
