/* A language whose numbers have a decimal comma. */
#ifndef TESTS_COMMA_H
#define TESTS_COMMA_H
#include "tests/test.h"
#include <locale.h>

/* Sets it for the process; skips the test where none is installed. */
static inline void comma_locale(void)
{
    static const char *const names[] = {"de_DE.UTF-8", "de_DE.utf8", "fr_FR.UTF-8", "nl_NL.UTF-8", "de_DE", "fr_FR"};
    for (size_t i = 0; i < sizeof names / sizeof *names; i++)
        if (setlocale(LC_ALL, names[i]) && *localeconv()->decimal_point == ',') return;
    test_skip("no locale with a decimal comma is installed");
}
#endif
