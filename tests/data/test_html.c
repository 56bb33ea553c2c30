/* Pages: names and bytes from anywhere must not become markup, and what fills a slot is not looked into. */
#include "data/html.h"
#include "tests/test.h"
#include <stdlib.h>
#include <string.h>

static char *text;
static size_t length;

static FILE *start(void)
{
    free(text);
    FILE *f = open_memstream(&text, &length);
    CHECK(f, "open_memstream");
    return f;
}

static void is(FILE *f, const char *expected)
{
    CHECK(fclose(f) == 0 && strcmp(text, expected) == 0, "'%s' instead of '%s'", text, expected);
}

static void put_user(FILE *f, void *user) { fputs(user, f); }

TEST(html_page_has_its_slots_filled)
{
    const io_slot slots[] = {{"a", "{{b}}", NULL}, {"b", NULL, put_user}, {NULL, NULL, NULL}};
    char user[] = "told";
    static const struct {
        const char *page, *expected;
    } known[] = {{"", ""},
                 {"no slot", "no slot"},
                 {"x{{a}}y{{b}}{{b}}z", "x{{b}}ytoldtoldz"},
                 {"{{c}} {{ab}} {{}} {{b", "{{c}} {{ab}} {{}} {{b"},
                 {"{{{b}}}", "{told}"},
                 {"{{c{{b}}", "{{ctold"}};
    for (size_t i = 0; i < sizeof known / sizeof *known; i++) {
        FILE *f = start();
        io_put_page(f, known[i].page, slots, user);
        is(f, known[i].expected);
    }
}

TEST(html_names_are_no_markup)
{
    FILE *f = start();
    io_put_text(f, "a<b>&\"c\" \xc3\xa9 \xff");
    is(f, "a&lt;b&gt;&amp;&quot;c&quot; \xc3\xa9 \\xFF");
    f = start();
    io_put_url_part(f, "javascript:a b/\xc3\xa9%#?\"<.x-_~9");
    is(f, "javascript%3Aa%20b%2F%C3%A9%25%23%3F%22%3C.x-_~9");
}

/* RFC 4648, section 10. */
TEST(html_base64)
{
    static const char *const known[][2] = {{"", ""},
                                           {"f", "Zg=="},
                                           {"fo", "Zm8="},
                                           {"foo", "Zm9v"},
                                           {"foob", "Zm9vYg=="},
                                           {"fooba", "Zm9vYmE="},
                                           {"foobar", "Zm9vYmFy"}};
    for (size_t i = 0; i < sizeof known / sizeof *known; i++) {
        FILE *f = start();
        io_put_base64(f, (const unsigned char *)known[i][0], strlen(known[i][0]));
        is(f, known[i][1]);
    }
    const unsigned char bytes[] = {0, 0xfb, 0xff};
    FILE *f = start();
    io_put_base64(f, bytes, 3);
    is(f, "APv/");
}
