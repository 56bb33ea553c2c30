#include "infer/page.h"
#include "data/file.h"
#include "data/html.h"
#include "data/text.h"
#include "infer/preview.h"
#include "pages.h"
#include "render/brdf.h"
#include <math.h>
#include <stdlib.h>

#define SPHERE 0.42 /* radius in sides of the sample: the picture has a margin around it */

typedef struct page {
    const char *name;
    const lgd_photo *photo;
    const lgd_order *order;
    int whole;         /* pixels a side of the material */
    io_image m, image; /* [size][size], MAP_CHANNELS and 3 channels: the material and the photograph in the page */
    io_image picture;  /* [size][size][3]: the next one */
    ts_status *st;
} page;

/* The picture as a PNG. */
static void put_picture(const page *p, FILE *f, bool srgb)
{
    unsigned char *bytes = NULL;
    size_t size = 0;
    if (p->st->code || io_png_bytes(&p->picture, 8, srgb, &bytes, &size, p->st) != TS_OK) return;
    io_put_base64(f, bytes, size);
    free(bytes);
}

static void put_colours(page *p, FILE *f, int first)
{
    const size_t pixels = (size_t)p->m.width * (size_t)p->m.width;
    for (size_t i = 0; i < pixels; i++)
        for (size_t c = 0; c < 3; c++)
            p->picture.data[3 * i + c] = io_unit(p->m.data[i * MAP_CHANNELS + (size_t)first + c]);
    put_picture(p, f, true);
}

static void put_diffuse(FILE *f, void *user) { put_colours(user, f, MAP_DIFFUSE); }
static void put_specular(FILE *f, void *user) { put_colours(user, f, MAP_SPECULAR); }

static void put_photo(FILE *f, void *user)
{
    page *p = user;
    const size_t values = (size_t)p->m.width * (size_t)p->m.width * 3;
    for (size_t i = 0; i < values; i++) p->picture.data[i] = p->image.data[i];
    put_picture(p, f, true);
}

/* Normal x and y and roughness as numbers 0 .. 65535, of each one byte. */
static void put_details(page *p, FILE *f, bool high)
{
    static const int channel[3] = {MAP_NORMAL, MAP_NORMAL + 1, MAP_ROUGHNESS};
    const size_t pixels = (size_t)p->m.width * (size_t)p->m.width;
    for (size_t i = 0; i < pixels; i++)
        for (int c = 0; c < 3; c++) {
            const unsigned v = (unsigned)(io_unit(p->m.data[i * MAP_CHANNELS + (size_t)channel[c]]) * 65535 + 0.5f);
            p->picture.data[3 * i + (size_t)c] = (float)(high ? v >> 8 : v & 255) / 255;
        }
    put_picture(p, f, false);
}

static void put_high(FILE *f, void *user) { put_details(user, f, true); }
static void put_low(FILE *f, void *user) { put_details(user, f, false); }

static void put_name(FILE *f, void *user) { io_put_text(f, ((const page *)user)->name); }

static void put_vector(FILE *f, const char *name, const float v[3])
{
    fprintf(f, "\"%s\": [%.7g, %.7g, %.7g], ", name, (double)v[0], (double)v[1], (double)v[2]);
}

static void put_facts(FILE *f, void *user)
{
    const page *p = user;
    const float guards[3] = {(float)rd_guards.roughness, (float)rd_guards.nz2, (float)rd_guards.distance2};
    const rd_view first = lgd_preview_view(0, p->photo);
    fprintf(f, "{\"size\": %d, \"repeats\": %s, \"radius\": %g, ", p->m.width, p->order->repeats ? "true" : "false",
            SPHERE);
    put_vector(f, "guards", guards);
    put_vector(f, "flash", p->photo->light);
    put_vector(f, "flashCamera", p->photo->camera);
    put_vector(f, "camera", first.camera);
    fprintf(f, "\"flashPower\": %.7g, \"flashAmbient\": %.7g, \"power\": %.7g, \"lights\": [", (double)p->photo->power,
            p->order->ambient, (double)first.power);
    for (int i = 0; i < LGD_PREVIEW_LIGHTS; i++) {
        const rd_view view = lgd_preview_view(i, p->photo);
        fprintf(f, "%s[%.7g, %.7g, %.7g]", i ? ", " : "", (double)view.light[0], (double)view.light[1],
                (double)view.light[2]);
    }
    fputs("]}", f);
}

static void put_about(FILE *f, void *user)
{
    const page *p = user;
    fprintf(f, "%d &#215; %d pixels", p->whole, p->whole);
    if (p->m.width < p->whole) fprintf(f, ", shown with %d &#215; %d", p->m.width, p->m.width);
    fprintf(f, ". Field of view %.1f&#176; (", rd_fov_of((double)p->photo->camera[2]));
    io_put_text(f, p->order->fov_from);
    fputs(").", f);
    if (p->order->repeats) fputs(" The maps were made seamless: they do not lie on the photograph.", f);
    fputs(" Made by lgd-infer " LGD_VERSION ".", f);
}

/* At most LGD_PAGE_MOST pixels a side. */
static ts_code fit(page *p, const io_material *m, ts_status *st)
{
    const int size = m->size < LGD_PAGE_MOST ? m->size : LGD_PAGE_MOST;
    const io_image maps = {m->size, m->size, MAP_CHANNELS, m->maps},
                   photo = {m->size, m->size, 3, (float *)p->photo->image}; /* only read */
    ts_code code = io_centre_square(&maps, size, p->order->threads, &p->m, st);
    if (!code) code = io_centre_square(&photo, size, p->order->threads, &p->image, st);
    return code ? code : io_image_create(&p->picture, size, size, 3, st);
}

ts_code lgd_write_page(const char *path, const char *name, const io_material *m, const lgd_photo *photo,
                       const lgd_order *order, ts_status *st)
{
    static const io_slot slots[] = {
        {"name", NULL, put_name},         {"style", page_view_css, NULL}, {"script", page_view_js, NULL},
        {"shader", page_view_glsl, NULL}, {"photo", NULL, put_photo},     {"diffuse", NULL, put_diffuse},
        {"specular", NULL, put_specular}, {"high", NULL, put_high},       {"low", NULL, put_low},
        {"facts", NULL, put_facts},       {"about", NULL, put_about},     {NULL, NULL, NULL}};
    page p = {.name = name, .photo = photo, .order = order, .whole = m->size, .st = st};
    io_text text = {0};
    ts_code code = fit(&p, m, st);
    if (!code) code = io_text_begin(&text, path, st);
    if (!code) {
        io_put_page(text.f, page_view_html, slots, &p);
        code = io_text_end(&text, path, st);
    }
    if (!code) code = st->code ? st->code : io_write_bytes(path, text.bytes, text.size, st);
    free(text.bytes);
    io_image_free(&p.m);
    io_image_free(&p.image);
    io_image_free(&p.picture);
    return code;
}
