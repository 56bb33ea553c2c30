/* The sheet as a drawing of black rectangles, in millimetres from the paper's top left. */
#include "data/file.h"
#include "data/rectify/tag_sheet.h"
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#define POINT (72 / 25.4) /* a millimetre in PDF's unit */
#define RULER 100.0

typedef struct drawing {
    FILE *f;
    const io_paper *paper;
    bool svg;
} drawing;

static void rectangle(const drawing *d, double x, double y, double w, double h)
{
    if (d->svg) fprintf(d->f, "<rect x=\"%.4f\" y=\"%.4f\" width=\"%.4f\" height=\"%.4f\"/>\n", x, y, w, h);
    else fprintf(d->f, "%.4f %.4f %.4f %.4f re\n", x * POINT, (d->paper->height - y - h) * POINT, w * POINT, h * POINT);
}

static void text(const drawing *d, double x, double y, double size, const char *words)
{
    if (d->svg)
        fprintf(d->f,
                "<text x=\"%.4f\" y=\"%.4f\" font-family=\"Helvetica,Arial,sans-serif\" font-size=\"%.2f\">%s</text>\n",
                x, y, size, words);
    else
        fprintf(d->f, "BT /F 1 Tf %.4f 0 0 %.4f %.4f %.4f Tm (%s) Tj ET\n", size * POINT, size * POINT, x * POINT,
                (d->paper->height - y) * POINT, words);
}

/* Runs of black cells, so that no hairline is between two of a row. */
static void tag(const drawing *d, int id, const io_tag_image black)
{
    const double cell = IO_TAG_CELL * IO_SHEET_WINDOW;
    double centre[2];
    io_tag_centre(id, centre);
    const double left = d->paper->width / 2 + (centre[0] * IO_SHEET_WINDOW) - IO_TAG_CELLS / 2.0 * cell;
    const double top = d->paper->height / 2 - (centre[1] * IO_SHEET_WINDOW) - IO_TAG_CELLS / 2.0 * cell;
    for (int r = 0; r < IO_TAG_CELLS; r++)
        for (int c = 0; c < IO_TAG_CELLS; c++) {
            int end = c;
            while (end < IO_TAG_CELLS && black[r][end]) end++;
            if (end > c) rectangle(d, left + c * cell, top + r * cell, (end - c) * cell, cell);
            c = end > c ? end : c;
        }
}

static void draw(const drawing *d, io_tag_image black[IO_SHEET_TAGS])
{
    const double line = 0.3, left = (d->paper->width - IO_SHEET_WINDOW) / 2,
                 top = (d->paper->height - IO_SHEET_WINDOW) / 2;
    for (int id = 0; id < IO_SHEET_TAGS; id++) tag(d, id, (const bool(*)[IO_TAG_CELLS])black[id]);
    /* the window's outline, to be cut away with it; wider than a pixel of a screen, 25.4/96, where browsers round */
    rectangle(d, left, top, IO_SHEET_WINDOW, line);
    rectangle(d, left, top + IO_SHEET_WINDOW - line, IO_SHEET_WINDOW, line);
    rectangle(d, left, top, line, IO_SHEET_WINDOW);
    rectangle(d, left + IO_SHEET_WINDOW - line, top, line, IO_SHEET_WINDOW);
    const double ruler = (d->paper->width - RULER) / 2, low = d->paper->height - 25;
    rectangle(d, ruler, low, RULER, line);
    rectangle(d, ruler, low - 2, line, 4);
    rectangle(d, ruler + RULER - line, low - 2, line, 4);
    if (!d->svg) fputs("f\n", d->f);
    static const char *const words[] = {"Cut out along the line.", "Lay the sheet flat on the sample.",
                                        "Photograph the whole frame with the flash."};
    for (int k = 0; k < 3; k++) text(d, left + 6, top + IO_SHEET_WINDOW / 2 + 8 * (k - 1), 4.5, words[k]);
    text(d, ruler, low + 6, 4, "100 mm when printed at full size (other sizes work too)");
}

static void write_svg(FILE *f, const io_paper *paper, io_tag_image black[IO_SHEET_TAGS])
{
    const drawing d = {f, paper, true};
    fprintf(f, "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"%gmm\" height=\"%gmm\" viewBox=\"0 0 %g %g\">\n",
            paper->width, paper->height, paper->width, paper->height);
    fprintf(f, "<rect width=\"%g\" height=\"%g\" fill=\"white\"/>\n<g shape-rendering=\"crispEdges\">\n", paper->width,
            paper->height);
    draw(&d, black);
    fputs("</g>\n</svg>\n", f);
}

/* ISO 32000-1: five objects and the table of where they begin. False when the stream does not say where. */
static bool write_pdf(FILE *f, const io_paper *paper, const char *content, size_t size)
{
    long at[6] = {0};
    bool placed = true;
    fputs("%PDF-1.4\n", f);
    for (int k = 1; k <= 5; k++) {
        at[k] = ftell(f);
        placed &= at[k] >= 0;
        fprintf(f, "%d 0 obj\n", k);
        if (k == 1) fputs("<< /Type /Catalog /Pages 2 0 R /ViewerPreferences << /PrintScaling /None >> >>\n", f);
        if (k == 2) fputs("<< /Type /Pages /Kids [3 0 R] /Count 1 >>\n", f);
        if (k == 3)
            fprintf(
                f,
                "<< /Type /Page /Parent 2 0 R /MediaBox [0 0 %.4f %.4f] /Contents 4 0 R /Resources << /Font << /F 5 "
                "0 R >> >> >>\n",
                paper->width * POINT, paper->height * POINT);
        if (k == 4) {
            fprintf(f, "<< /Length %zu >>\nstream\n", size);
            fwrite(content, 1, size, f);
            fputs("\nendstream\n", f);
        }
        if (k == 5) fputs("<< /Type /Font /Subtype /Type1 /BaseFont /Helvetica >>\n", f);
        fputs("endobj\n", f);
    }
    const long table = ftell(f);
    fputs("xref\n0 6\n0000000000 65535 f \n", f);
    for (int k = 1; k <= 5; k++) fprintf(f, "%010ld 00000 n \n", at[k]);
    fprintf(f, "trailer\n<< /Size 6 /Root 1 0 R >>\nstartxref\n%ld\n%%%%EOF\n", table);
    return placed && table >= 0;
}

ts_code io_sheet_print(const char *path, const io_paper *paper, ts_status *st)
{
    io_tag_image black[IO_SHEET_TAGS];
    const char *dot = strrchr(path, '.');
    const bool svg = dot && !strcmp(dot, ".svg");
    if (!svg && !(dot && !strcmp(dot, ".pdf")))
        return ts_fail(st, TS_INVALID, "%s: the sheet's name must end in .pdf or .svg", path);
    if (io_tag_images(black, st) != TS_OK) return st->code;
    char *content = NULL, *file = NULL;
    size_t size = 0, total = 0;
    bool written = false;
    FILE *f = open_memstream(&content, &size);
    if (f && svg) write_svg(f, paper, black);
    else if (f) draw(&(drawing){f, paper, false}, black);
    if (f && fclose(f) == 0 && content) {
        FILE *whole = svg ? NULL : open_memstream(&file, &total);
        const bool placed = whole && write_pdf(whole, paper, content, size);
        const bool closed = whole && fclose(whole) == 0;
        written = svg || (placed && closed && file);
    }
    const ts_code code = written ? io_write_bytes(path, svg ? content : file, svg ? size : total, st)
                                 : ts_fail(st, TS_NOMEM, "%s: out of memory", path);
    free(content);
    free(file);
    return code;
}
