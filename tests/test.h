/* The test runner's interface. A file tests/test_NAME.c holds TEST(name) { … } blocks; each runs in a process of its
 * own. */
#ifndef TEST_H
#define TEST_H
#include "tests/support/farther.h"
#include <stdbool.h>
#include <stdio.h>

typedef void (*test_function)(void);
void test_register(const char *name, test_function f);

#define TEST(name)                                                                                        \
    static void test_##name(void);                                                                        \
    __attribute__((constructor)) static void register_##name(void) { test_register(#name, test_##name); } \
    static void test_##name(void)

/* Ends the test as failed, with a message. */
void test_fail(const char *file, int line, const char *format, ...) __attribute__((format(printf, 3, 4), noreturn));
/* Ends the test as skipped; the runner names it and the reason. */
void test_skip(const char *format, ...) __attribute__((format(printf, 1, 2), noreturn));

#define CHECK(condition, ...)                                         \
    do {                                                              \
        if (!(condition)) test_fail(__FILE__, __LINE__, __VA_ARGS__); \
    } while (0)

/* The folder of real data or of fixtures; skips the test when it is absent. */
const char *test_data(void);
const char *test_fixtures(void);
/* A fresh empty folder for this test, removed afterwards. */
const char *test_folder(void);
/* build/, or as the environment has it (programs are in test_build()/bin). */
const char *test_build(void);
#endif
