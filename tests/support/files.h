/* Files of tests, as bytes. A test fails where a file cannot be read or written. */
#ifndef TESTS_FILES_H
#define TESTS_FILES_H
#include <stddef.h>

/* The path of that name in the test's folder; it stays valid until the next but seven calls. */
const char *path_of(const char *name);

/* The whole file, with a zero byte behind it, which *size does not count. The caller frees it. */
char *slurp(const char *path, size_t *size);

void spill(const char *path, const void *data, size_t size);
#endif
