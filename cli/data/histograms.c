#include "cli/data/histograms.h"
#include "cli/cli.h"
#include "data/materials/histogram.h"
#include <stdio.h>

static ts_code write_files(const char *output, const io_histogram *theirs, const io_histogram *ours, ts_status *st)
{
    char csv[4096], svg[4096];
    if (snprintf(csv, sizeof csv, "%s/histograms.csv", output) >= (int)sizeof csv)
        return ts_fail(st, TS_INVALID, "%s: the path is too long", output);
    snprintf(svg, sizeof svg, "%s/histograms.svg", output);
    const ts_code code = io_histogram_csv(csv, theirs, ours, "testdata", "procedural", st);
    return code ? code : io_histogram_svg(svg, theirs, ours, "testdata", "procedural", st);
}

ts_code cl_write_histograms(const char *output, const io_procedural *p, uint64_t first, int count, const char *testdata,
                            int size, ts_status *st)
{
    io_histogram ours = {0}, theirs = {0};
    io_material m = {0};
    ts_code code = io_histogram_folder(testdata, size, &theirs, st);
    if (!code) code = io_material_create(&m, size, st);
    for (int i = 0; !code && i < count; i++) {
        if (cl_interrupted()) code = ts_fail(st, TS_INTERRUPTED, "interrupted after %d of %d materials", i, count);
        io_procedural_make(p, first + (uint64_t)i, &m);
        io_histogram_add(&ours, m.maps, size);
    }
    io_material_free(&m);
    if (!code) code = write_files(output, &theirs, &ours, st);
    for (int k = 0; !code && k < IO_HISTOGRAMS; k++)
        printf("%-10s %5.1f%% in common\n", io_histogram_name(k), 100 * io_histogram_overlap(&theirs, &ours, k));
    return code;
}
