#include "cli/infer/index.h"
#include "data/file.h"
#include "data/html.h"
#include "infer/panels.h"
#include "infer/preview.h"
#include "pages.h"
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>

#define ABOUT "Made by lgd-infer " /* at the page's end */

enum {
    PANEL = 128,
    LIGHT = 1,     /* upper left, of the preview's */
    PICTURES = 500 /* at most 50 MB: later materials have a name alone */
};

/* Whether the page ends as those of cl_index_end do. */
static bool is_ours(const char *path)
{
    enum { TAIL = 256 };
    char tail[TAIL + 1] = "";
    FILE *f = fopen(path, "rb");
    if (!f) return false;
    if (fseek(f, -TAIL, SEEK_END) != 0) rewind(f);
    tail[fread(tail, 1, TAIL, f)] = 0;
    fclose(f);
    return strstr(tail, ABOUT);
}

static ts_code check(const cl_plan *plan, const char *folder, ts_status *st)
{
    struct stat there, photo;
    char *path = NULL;
    ts_code code = TS_OK;
    if (asprintf(&path, "%s/%s", folder, CL_INDEX_NAME) < 0) return ts_fail(st, TS_NOMEM, "out of memory");
    const bool exists = stat(path, &there) == 0;
    if (exists && S_ISDIR(there.st_mode)) code = ts_fail(st, TS_INVALID, "%s: is in the way: it is a folder", path);
    for (int i = 0; i < plan->jobs && !code; i++) {
        const char *name = plan->job[i].photo;
        if (strcmp(plan->job[i].stem, CL_INDEX_NAME) == 0)
            code = ts_fail(st, TS_INVALID, "%s would be written to %s, which is the page of all: rename it", name,
                           path);
        else if (exists && stat(name, &photo) == 0 && photo.st_dev == there.st_dev && photo.st_ino == there.st_ino)
            code = ts_fail(st, TS_INVALID, "%s would replace the photograph %s: use another output folder", path, name);
    }
    if (!code && exists && !is_ours(path))
        code = ts_fail(st, TS_INVALID, "%s: is in the way: lgd-infer did not make it; use another output folder", path);
    free(path);
    return code;
}

ts_code cl_index_start(cl_index *index, const cl_plan *plan, const char *folder, ts_status *st)
{
    *index = (cl_index){0};
    if (check(plan, folder, st) != TS_OK) return st->code;
    return io_text_begin(&index->cards, CL_INDEX_NAME, st);
}

/* The photograph beside the maps under one light, as a PNG. */
static ts_code picture(const cl_item *item, unsigned char **bytes, size_t *size, ts_status *st)
{
    const int side = item->m.size, panel = side < PANEL ? side : PANEL;
    const io_image maps = {side, side, MAP_CHANNELS, item->m.maps},
                   photo = {side, side, 3, (float *)item->image}; /* only read */
    const rd_view view = lgd_preview_view(LIGHT, &item->photo[0]);
    io_image small = {0}, square = {0}, both = {0}, scratch = {0};
    ts_code code = io_centre_square(&maps, panel, 0, &small, st);
    if (!code) code = io_centre_square(&photo, panel, 0, &square, st);
    if (!code) code = io_image_create(&both, 2 * panel, panel, 3, st);
    if (!code) code = io_image_create(&scratch, panel, panel, 3, st);
    if (!code) {
        const io_material m = {.size = panel, .maps = small.data};
        lgd_panel_put(&both, panel, 0, 0, square.data);
        lgd_panel_render(&both, 1, 0, &m, &view, scratch.data);
        code = io_png_bytes(&both, 8, true, bytes, size, st);
    }
    io_image_free(&small);
    io_image_free(&square);
    io_image_free(&both);
    io_image_free(&scratch);
    return code;
}

static void put_heading(FILE *f, const char *name)
{
    fputs("<h2>", f);
    io_put_text(f, name);
    fputs("</h2>\n", f);
}

ts_code cl_index_add(cl_index *index, const cl_item *item, ts_status *st)
{
    FILE *f = index->cards.f;
    unsigned char *bytes = NULL;
    size_t size = 0;
    if (!f) return TS_OK;
    if (item->st.code) {
        index->failed++;
        fputs("<div class=\"card failed\">\n", f);
        put_heading(f, item->job->stem);
        fputs("<p>", f);
        io_put_text(f, item->st.message);
        fputs("</p>\n</div>\n", f);
        return TS_OK;
    }
    const bool shown = !item->was_done && index->materials < PICTURES; /* what was done lies on the disk alone */
    if (shown && picture(item, &bytes, &size, st) != TS_OK) return st->code;
    index->materials++;
    fputs("<a class=\"card\" href=\"", f);
    io_put_url_part(f, item->job->stem);
    fputs("/view.html\">\n", f);
    if (shown) {
        fputs("<img alt=\"The photograph, and the material under a light from the upper left\" "
              "src=\"data:image/png;base64,",
              f);
        io_put_base64(f, bytes, size);
        fputs("\">\n", f);
    }
    put_heading(f, item->job->stem);
    if (item->was_done) fputs("<p>Complete from an earlier call</p>\n</a>\n", f);
    else fprintf(f, "<p>Difference from the photograph %.4f</p>\n</a>\n", item->last);
    free(bytes);
    return TS_OK;
}

static void put_summary(FILE *f, void *user)
{
    const cl_index *index = user;
    fprintf(f, "%d material%s. Left the photograph, right the material under another light; choose one to light it.",
            index->materials, index->materials == 1 ? "" : "s");
    if (index->failed) fprintf(f, " %d photograph%s failed.", index->failed, index->failed == 1 ? "" : "s");
}

static void put_cards(FILE *f, void *user) { fputs(((const cl_index *)user)->cards.bytes, f); }

ts_code cl_index_end(cl_index *index, const char *folder, ts_status *st)
{
    static const io_slot slots[] = {{"style", page_index_css, NULL},
                                    {"summary", NULL, put_summary},
                                    {"cards", NULL, put_cards},
                                    {"about", ABOUT LGD_VERSION ".", NULL},
                                    {NULL, NULL, NULL}};
    char *path = NULL;
    io_text page = {0};
    if (!index->cards.f) return TS_OK;
    ts_code code = st->code;
    const ts_code whole = io_text_end(&index->cards, CL_INDEX_NAME, code ? NULL : st);
    if (!code) code = whole;
    if (!code && index->materials + index->failed > 0) { /* not interrupted before the first */
        if (asprintf(&path, "%s/%s", folder, CL_INDEX_NAME) < 0) {
            path = NULL; /* undefined after a failure */
            code = ts_fail(st, TS_NOMEM, "out of memory for %s/%s", folder, CL_INDEX_NAME);
        }
        if (!code) code = io_text_begin(&page, path, st);
        if (!code) {
            io_put_page(page.f, page_index_html, slots, index);
            code = io_text_write(&page, path, st);
        }
    }
    free(path);
    free(index->cards.bytes);
    *index = (cl_index){0};
    return code;
}
