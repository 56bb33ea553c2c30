/* Texts that are printed into memory. */
#include "data/text.h"
#include "tests/support/comma.h"
#include "tests/test.h"
#include <stdlib.h>
#include <string.h>

TEST(text_numbers_do_not_depend_on_the_locale)
{
    io_text t, inner;
    ts_status st = {0};
    char own[16];
    comma_locale();
    CHECK(io_text_begin(&t, "a text", &st) == TS_OK && io_text_begin(&inner, "another", &st) == TS_OK, "%s",
          st.message);
    fprintf(inner.f, "%g", 0.25);
    CHECK(io_text_end(&inner, "another", &st) == TS_OK, "%s", st.message);
    fprintf(t.f, "%g", 0.75);
    CHECK(io_text_end(&t, "a text", &st) == TS_OK, "%s", st.message);
    CHECK(!strcmp(inner.bytes, "0.25") && !strcmp(t.bytes, "0.75"), "%s and %s", inner.bytes, t.bytes);
    snprintf(own, sizeof own, "%g", 0.5);
    CHECK(!strcmp(own, "0,5"), "the caller's own language is gone: %s", own);
    free(inner.bytes);
    free(t.bytes);
}
