#include "data/materials/histogram.h"
#include "data/file.h"
#include <math.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static const char *const names[IO_HISTOGRAMS] = {"diffuse", "roughness", "specular", "slope", "saturation"};

const char *io_histogram_name(int histogram)
{
    return histogram >= 0 && histogram < IO_HISTOGRAMS ? names[histogram] : "none";
}

void io_histogram_add(io_histogram *h, const float *maps, int size)
{
    const double one = 1.0 / ((double)size * size);
    for (int i = 0; i < size * size; i++) {
        double v[IO_VALUES];
        io_values(maps + (size_t)i * MAP_CHANNELS, v);
        for (int k = 0; k < IO_HISTOGRAMS; k++) {
            const int bin = (int)(v[k] * IO_BINS);
            h->share[k][bin < 0 ? 0 : bin >= IO_BINS ? IO_BINS - 1 : bin] += one;
        }
    }
    h->count++;
}

static ts_code add(void *context, const io_material *m, ts_status *st)
{
    (void)st;
    io_histogram_add(context, m->maps, m->size);
    return TS_OK;
}

ts_code io_histogram_folder(const char *folder, int size, io_histogram *h, ts_status *st)
{
    const int before = h->count;
    ts_code code = io_visit_materials(folder, size, add, h, st);
    return code || h->count > before ? code : ts_fail(st, TS_IO, "%s: has no materials in maps/ or strips/", folder);
}

double io_histogram_overlap(const io_histogram *a, const io_histogram *b, int histogram)
{
    double sum = 0;
    for (int i = 0; i < IO_BINS; i++) sum += fmin(a->share[histogram][i] / a->count, b->share[histogram][i] / b->count);
    return sum;
}

/* A text that grows no further than its array. */
typedef struct text {
    size_t length;
    char bytes[1 << 16];
} text;

static void __attribute__((format(printf, 2, 3))) say(text *t, const char *format, ...)
{
    va_list list;
    va_start(list, format);
    const int n = vsnprintf(t->bytes + t->length, sizeof t->bytes - t->length, format, list);
    va_end(list);
    if (n > 0) t->length = t->length + (size_t)n < sizeof t->bytes ? t->length + (size_t)n : sizeof t->bytes - 1;
}

/* Fixed point by integers: no language's decimal comma gets in. */
static void say_fixed(text *t, double v)
{
    const long n = lround(v * 100000);
    say(t, "%ld.%05ld", n / 100000, n % 100000);
}

static ts_code finish(text *t, const char *path, ts_status *st)
{
    if (!t) return ts_fail(st, TS_NOMEM, "%s: no memory for the text", path);
    ts_code code = io_write_bytes(path, t->bytes, t->length, st);
    free(t);
    return code;
}

ts_code io_histogram_csv(const char *path, const io_histogram *a, const io_histogram *b, const char *name_a,
                         const char *name_b, ts_status *st)
{
    text *t = calloc(1, sizeof *t);
    if (t) say(t, "map,from,to,%s,%s\n", name_a, name_b);
    for (int k = 0; t && k < IO_HISTOGRAMS; k++)
        for (int i = 0; i < IO_BINS; i++) {
            say(t, "%s,", names[k]);
            say_fixed(t, (double)i / IO_BINS);
            say(t, ",");
            say_fixed(t, (double)(i + 1) / IO_BINS);
            say(t, ",");
            say_fixed(t, a->share[k][i] / a->count);
            say(t, ",");
            say_fixed(t, b->share[k][i] / b->count);
            say(t, "\n");
        }
    return finish(t, path, st);
}

enum { PANEL = 220, TALL = 120, GAP = 24, TOP = 40 };

/* The steps of one histogram as an outline from the lower left to the lower right corner; heights by the square root,
 * which shows rare values too. */
static void outline(text *t, const io_histogram *h, int k, int x, double scale, const char *style)
{
    say(t, "<path d=\"M%d %d", x, TOP + TALL);
    for (int i = 0; i < IO_BINS; i++)
        say(t, "V%d H%d", TOP + TALL - (int)lround(TALL * sqrt(h->share[k][i] / h->count) * scale),
            x + PANEL * (i + 1) / IO_BINS);
    say(t, "V%dZ\" %s/>\n", TOP + TALL, style);
}

ts_code io_histogram_svg(const char *path, const io_histogram *a, const io_histogram *b, const char *name_a,
                         const char *name_b, ts_status *st)
{
    text *t = calloc(1, sizeof *t);
    const int width = IO_HISTOGRAMS * (PANEL + GAP) + GAP, height = TOP + TALL + 30;
    if (t)
        say(t,
            "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"%d\" height=\"%d\" font-family=\"sans-serif\" "
            "font-size=\"13\">\n"
            "<rect width=\"%d\" height=\"%d\" fill=\"#fff\"/>\n"
            "<text x=\"%d\" y=\"16\" fill=\"#777\">filled: %s (%d)</text><text x=\"%d\" y=\"16\" fill=\"#c33\">line: "
            "%s (%d)</text>\n",
            width, height, width, height, GAP, name_a, a->count, GAP + 260, name_b, b->count);
    for (int k = 0; t && k < IO_HISTOGRAMS; k++) {
        const int x = GAP + k * (PANEL + GAP);
        double most = 0;
        for (int i = 0; i < IO_BINS; i++) most = fmax(most, fmax(a->share[k][i] / a->count, b->share[k][i] / b->count));
        const double scale = 1 / sqrt(most);
        say(t, "<text x=\"%d\" y=\"%d\">%s, %d%% in common</text>\n", x, TOP - 6, names[k],
            (int)lround(100 * io_histogram_overlap(a, b, k)));
        outline(t, a, k, x, scale, "fill=\"#bbb\"");
        outline(t, b, k, x, scale, "fill=\"none\" stroke=\"#c33\" stroke-width=\"1.5\"");
        say(t, "<text x=\"%d\" y=\"%d\" fill=\"#555\">0</text><text x=\"%d\" y=\"%d\" fill=\"#555\">1</text>\n", x,
            TOP + TALL + 16, x + PANEL - 8, TOP + TALL + 16);
    }
    if (t) say(t, "</svg>\n");
    return finish(t, path, st);
}
