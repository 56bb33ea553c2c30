/* view.html as text; tests/cli/page.sh opens it in a browser. */
#include "data/file.h"
#include "infer/page.h"
#include "tests/test.h"
#include <stdlib.h>
#include <string.h>

static char *written(int size, const lgd_order *order)
{
    io_material m = {0};
    io_image photo = {0};
    ts_status st = {0};
    char path[300], *text = NULL;
    size_t length = 0;
    CHECK(io_material_create(&m, size, &st) == TS_OK && io_image_create(&photo, size, size, 3, &st) == TS_OK, "%s",
          st.message);
    const lgd_photo flash = lgd_flash_photo(photo.data);
    snprintf(path, sizeof path, "%s/view.html", test_folder());
    CHECK(lgd_write_page(path, "<x>{{photo}}", &m, &flash, order, &st) == TS_OK, "%s", st.message);
    CHECK(io_read_bytes(path, (size_t)1 << 28, &text, &length, &st) == TS_OK && strlen(text) == length, "%s",
          st.message);
    io_material_free(&m);
    io_image_free(&photo);
    return text;
}

TEST(page_says_what_it_shows)
{
    const lgd_order order = {.threads = 1, .fov_from = "a <test>"};
    char *text = written(5, &order);
    CHECK(strstr(text, "<h1>&lt;x&gt;{{photo}}</h1>") && strstr(text, "(a &lt;test&gt;)"), "names are markup");
    CHECK(strstr(text, "{\"size\": 5, \"repeats\": false, "), "the facts");
    CHECK(!strstr(text, "shown with") && !strstr(text, "seamless"), "5 x 5 pixels that do not repeat");
    free(text);
}

/* Phones have little memory for textures. */
TEST(page_of_large_maps_is_smaller)
{
    const lgd_order order = {.repeats = true, .threads = 1, .fov_from = "a test"};
    char *text = written(LGD_PAGE_MOST + 1, &order);
    CHECK(strstr(text, "1025 &#215; 1025 pixels, shown with 1024 &#215; 1024."), "it does not say so");
    CHECK(strstr(text, "{\"size\": 1024, \"repeats\": true, ") && strstr(text, "were made seamless"), "the facts");
    free(text);
}
