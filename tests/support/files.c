#include "tests/support/files.h"
#include "tests/test.h"
#include <stdlib.h>

const char *path_of(const char *name)
{
    static char path[8][1024];
    static int next;
    char *p = path[next++ % 8];
    snprintf(p, sizeof path[0], "%s/%s", test_folder(), name);
    return p;
}

char *slurp(const char *path, size_t *size)
{
    FILE *f = fopen(path, "rb");
    CHECK(f && !fseek(f, 0, SEEK_END), "%s cannot be read", path);
    const long n = ftell(f);
    rewind(f);
    char *data = n < 0 ? NULL : malloc((size_t)n + 1);
    CHECK(data && fread(data, 1, (size_t)n, f) == (size_t)n, "%s cannot be read", path);
    fclose(f);
    data[n] = 0;
    *size = (size_t)n;
    return data;
}

void spill(const char *path, const void *data, size_t size)
{
    FILE *f = fopen(path, "wb");
    CHECK(f && fwrite(data, 1, size, f) == size && !fclose(f), "%s cannot be written", path);
}
