#include "cli/plot.h"
#include "data/html.h"
#include <math.h>
#include <string.h>

enum { WIDTH = 760, HEIGHT = 420, LEFT = 70, RIGHT = 210, TOP = 20, BOTTOM = 50, TICKS = 6 };

/* Seven that differ for any colour vision (Okabe and Ito, "Color Universal Design", 2008), and three more.
 */
static const char *const colours[] = {"#0072b2", "#d55e00", "#009e73", "#cc79a7", "#e69f00",
                                      "#56b4e9", "#000000", "#8c564b", "#7f7f7f", "#9467bd"};
#define COLOUR(s) colours[(size_t)(s) % (sizeof colours / sizeof *colours)]

typedef struct frame {
    double x0, x1, y0, y1; /* of x its place */
    bool log_x;
} frame;

static bool shown(const frame *r, const cl_point *p)
{
    return isfinite(p->x) && (p->x > 0 || !r->log_x) && isfinite(p->y);
}
static double place(const frame *r, double x) { return r->log_x ? log10(x) : x; }
static double across(const frame *r, double x)
{
    return LEFT + (place(r, x) - r->x0) / (r->x1 - r->x0) * (WIDTH - LEFT - RIGHT);
}
static double down(const frame *r, double y) { return TOP + (r->y1 - y) / (r->y1 - r->y0) * (HEIGHT - TOP - BOTTOM); }

/* 1, 2 or 5 times a power of ten: the smallest that is at least v. */
static double round_step(double v)
{
    const double ten = pow(10, floor(log10(v)));
    return v <= ten ? ten : v <= 2 * ten ? 2 * ten : v <= 5 * ten ? 5 * ten : 10 * ten;
}

static bool make_frame(const cl_series *series, int count, bool log_x, frame *r)
{
    *r = (frame){INFINITY, -INFINITY, INFINITY, -INFINITY, log_x};
    for (int s = 0; s < count; s++)
        for (int i = 0; i < series[s].points; i++) {
            const cl_point *p = &series[s].point[i];
            if (!shown(r, p)) continue;
            r->x0 = fmin(r->x0, place(r, p->x)), r->x1 = fmax(r->x1, place(r, p->x));
            r->y0 = fmin(r->y0, p->y), r->y1 = fmax(r->y1, p->y);
        }
    if (r->x0 > r->x1) return false;
    const double mx = fmax(0.05, 0.06 * (r->x1 - r->x0)),
                 my = fmax(1e-4, 0.08 * (r->y1 - r->y0)); /* a single point has a frame too */
    r->x0 -= mx, r->x1 += mx, r->y0 -= my, r->y1 += my;
    return true;
}

static void tick(FILE *f, const frame *r, double x, bool number)
{
    fprintf(f, "<line x1=\"%.1f\" x2=\"%.1f\" y1=\"%d\" y2=\"%d\" stroke=\"#ddd\"/>", across(r, x), across(r, x), TOP,
            HEIGHT - BOTTOM);
    if (number)
        fprintf(f, "<text x=\"%.1f\" y=\"%d\" text-anchor=\"middle\">%.4g</text>\n", across(r, x), HEIGHT - BOTTOM + 16,
                x);
}

static void log_axis(FILE *f, const frame *r)
{
    const double decades = r->x1 - r->x0;
    for (int e = (int)floor(r->x0); e <= (int)ceil(r->x1); e++)
        for (int m = 1; m<10; m += decades> 3 ? 9 : 1) {
            const double x = m * pow(10, e);
            if (log10(x) >= r->x0 && log10(x) <= r->x1) tick(f, r, x, m == 1 || (decades < 2 && (m == 2 || m == 5)));
        }
}

static void draw_axes(FILE *f, const frame *r, const char *x_title, const char *y_title)
{
    fprintf(f, "<rect x=\"%d\" y=\"%d\" width=\"%d\" height=\"%d\" fill=\"none\" stroke=\"#888\"/>\n", LEFT, TOP,
            WIDTH - LEFT - RIGHT, HEIGHT - TOP - BOTTOM);
    const double step = round_step((r->y1 - r->y0) / TICKS);
    for (double y = ceil(r->y0 / step) * step + 0.0; y <= r->y1; y += step) /* + 0: no -0 */
        fprintf(f,
                "<line x1=\"%d\" x2=\"%d\" y1=\"%.1f\" y2=\"%.1f\" stroke=\"#ddd\"/><text x=\"%d\" y=\"%.1f\" "
                "text-anchor=\"end\">%.3g</text>\n",
                LEFT, WIDTH - RIGHT, down(r, y), down(r, y), LEFT - 6, down(r, y) + 4, y);
    if (r->log_x) log_axis(f, r);
    else {
        const double unit = round_step((r->x1 - r->x0) / TICKS);
        for (double x = ceil(r->x0 / unit) * unit + 0.0; x <= r->x1; x += unit) tick(f, r, x, true);
    }
    fprintf(f, "<text x=\"%d\" y=\"%d\" text-anchor=\"middle\">", (LEFT + WIDTH - RIGHT) / 2, HEIGHT - 10);
    io_put_text(f, x_title);
    fprintf(f, "</text>\n<text transform=\"translate(16 %d) rotate(-90)\" text-anchor=\"middle\">",
            (TOP + HEIGHT - BOTTOM) / 2);
    io_put_text(f, y_title);
    fputs("</text>\n", f);
}

/* The places of the labels so far. */
typedef struct labels {
    struct {
        double x, y, width;
    } box[256];
    int count;
} labels;

enum { LABEL_HEIGHT = 11, LABEL_ADVANCE = 6 }; /* of 10 pixel letters */

/* Beside the point, above or below, right or left of it, where no other label is; nowhere if there is no such place:
 * the point still shows it under the pointer. */
static void put_label(FILE *f, labels *all, double x, double y, const char *text)
{
    const double width = LABEL_ADVANCE * (double)strlen(text);
    for (int place = 0; place < 4; place++) {
        const double at_x = place & 2 ? x - 4 - width : x + 4, at_y = place & 1 ? y + 13 : y - 5;
        bool free = at_y < HEIGHT - BOTTOM && at_x > LEFT;
        for (int i = 0; i < all->count && free; i++)
            free = fabs(all->box[i].y - at_y) >= LABEL_HEIGHT || at_x >= all->box[i].x + all->box[i].width ||
                all->box[i].x >= at_x + width;
        if (!free || all->count == (int)(sizeof all->box / sizeof *all->box)) continue;
        all->box[all->count].x = at_x, all->box[all->count].y = at_y, all->box[all->count++].width = width;
        fprintf(f, "<text x=\"%.1f\" y=\"%.1f\" font-size=\"10\">", at_x, at_y);
        io_put_text(f, text);
        fputs("</text>", f);
        return;
    }
}

static void draw(FILE *f, const frame *r, const cl_series *series, int s, labels *all)
{
    const char *radius = series->points > 50 ? "1.5" : "3.5";
    const int legend = TOP + 12 + 18 * s;
    fprintf(f, "<g stroke=\"%s\" fill=\"none\"><polyline points=\"", COLOUR(s));
    for (int i = 0; i < series->points; i++)
        if (shown(r, &series->point[i]))
            fprintf(f, "%.1f,%.1f ", across(r, series->point[i].x), down(r, series->point[i].y));
    if (series->level && shown(r, series->point))
        fprintf(f, "%d,%.1f %d,%.1f", LEFT, down(r, series->point->y), WIDTH - RIGHT, down(r, series->point->y));
    fputs("\"/></g>\n", f);
    for (int i = 0; i < series->points; i++) {
        const cl_point *p = &series->point[i];
        if (!shown(r, p)) continue;
        fprintf(f, "<circle cx=\"%.1f\" cy=\"%.1f\" r=\"%s\" fill=\"%s\"><title>", across(r, p->x), down(r, p->y),
                radius, COLOUR(s));
        io_put_text(f, series->name);
        fprintf(f, " %s: %.4g, %.4f &#177; %.4f</title></circle>", p->label, p->x, p->y, p->deviation);
        if (p->label[0]) put_label(f, all, across(r, p->x), down(r, p->y), p->label);
        fputs("\n", f);
    }
    fprintf(f, "<circle cx=\"%d\" cy=\"%d\" r=\"3.5\" fill=\"%s\"/><text x=\"%d\" y=\"%d\">", WIDTH - RIGHT + 14,
            legend, COLOUR(s), WIDTH - RIGHT + 24, legend + 4);
    io_put_text(f, series->name);
    fputs("</text>\n", f);
}

void cl_plot_write(FILE *f, const cl_axes *axes, const cl_series *series, int count)
{
    frame r;
    labels all = {.count = 0};
    fprintf(f,
            "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 %d %d\" width=\"%d\" height=\"%d\" "
            "font-family=\"sans-serif\" font-size=\"12\">\n",
            WIDTH, HEIGHT, WIDTH, HEIGHT);
    fprintf(f, "<rect width=\"%d\" height=\"%d\" fill=\"#fff\"/>\n", WIDTH, HEIGHT);
    if (make_frame(series, count, axes->log_x, &r)) {
        draw_axes(f, &r, axes->x_title, axes->y_title);
        for (int s = 0; s < count; s++) draw(f, &r, &series[s], s, &all);
    } else fprintf(f, "<text x=\"%d\" y=\"%d\">nothing was measured</text>\n", LEFT, HEIGHT / 2);
    fputs("</svg>\n", f);
}
