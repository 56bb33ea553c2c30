/* lgd-capture: prints the sheet for several photographs of one sample, and checks the photographs. */
#include "cli/arguments.h"
#include "cli/cli.h"
#include "cli/operands.h"
#include "data/image/image.h"
#include "data/rectify/sheet_check.h"
#include "tensor/threads.h"
#include <math.h>
#include <stdio.h>
#include <string.h>

enum { PAPER = 256, FOV, MAX_PIXELS, HELP = 'h', VERSION = 'V' };

static const cl_argument arguments[] = {
    {'o', "output", "FILE", "of sheet: where the drawing goes, a name that ends in .pdf or .svg (required)"},
    {PAPER, "paper", "a4|letter", "of sheet: its paper (default a4)"},
    {FOV, "fov", "DEG",
     "of check: field of view across the photographs' shorter side, 3 .. 150 degrees\n(default: from EXIF)"},
    {'t', "threads", "N", "number of threads, 1 .. 1024; 0 = all that are allowed (default 0)"},
    {MAX_PIXELS, "max-pixels", "N", "of check: refuse photographs with more pixels (default 268435456)"},
    {HELP, "help", NULL, "print this help"},
    {VERSION, "version", NULL, "print the version"},
    {0, NULL, NULL, NULL}};

typedef struct command {
    const char *output;
    const io_paper *paper;       /* NULL: not given */
    double fov;                  /* 0: not given */
    int64_t threads, max_pixels; /* max_pixels 0: not given */
    bool help, version;
} command;

static void print_help(void)
{
    puts("Usage: lgd-capture sheet [--paper a4|letter] -o FILE\n"
         "       lgd-capture check PHOTO|FOLDER|@LIST...\n"
         "sheet draws the sheet to be printed: a window, to be cut out, in a frame of tags. lgd-infer --sheet finds "
         "camera\n"
         "and light of photographs of a sample in that window. check says what is wrong with such photographs, a line "
         "for\n"
         "each on standard output. FOLDER stands for the photographs in it, LIST is a file or a pipe that names one a "
         "line,\n"
         "@- is standard input; a photograph whose name begins with @ is written ./@NAME.\n");
    cl_argument_help(arguments, stdout);
    puts("\nExit status: 0 done and nothing wrong, 1 something is wrong, 2 wrong usage, 130 interrupted.");
}

static ts_code take_paper(const char *name, command *c, ts_status *st)
{
    for (c->paper = io_papers; c->paper->name; c->paper++)
        if (!strcmp(c->paper->name, name)) return TS_OK;
    return ts_fail(st, TS_INVALID, "--paper: '%s' is neither a4 nor letter", name);
}

static ts_code parse(int argc, char **argv, command *c, int *operands, ts_status *st)
{
    const char *value = NULL;
    int key;
    ts_code code = TS_OK;
    while (!code && !c->help && !c->version &&
           (key = cl_argument_next(argc, argv, arguments, &value, operands, st)) != CL_ARGUMENT_END)
        switch (key) {
        case 'o':
            c->output = value;
            code = cl_check_name("-o", value, st);
            break;
        case PAPER: code = take_paper(value, c, st); break;
        case FOV:
            if (!cl_parse_real(value, IO_FOV_LEAST, IO_FOV_MOST, &c->fov))
                code = ts_fail(st, TS_INVALID, "--fov: '%s' is not an angle in %g .. %g degrees", value, IO_FOV_LEAST,
                               IO_FOV_MOST);
            break;
        case 't':
            if (!cl_parse_int(value, 0, 1024, &c->threads))
                code = ts_fail(st, TS_INVALID, "--threads: '%s' is not a whole number in 0 .. 1024", value);
            break;
        case MAX_PIXELS:
            if (!cl_parse_int(value, 1, INT64_C(1) << 40, &c->max_pixels))
                code = ts_fail(st, TS_INVALID, "--max-pixels: '%s' is not a whole number above 0", value);
            break;
        case HELP: c->help = true; break;
        case VERSION: c->version = true; break;
        default: code = st->code;
        }
    return code;
}

/* A line about a photograph; true when nothing is wrong with it. */
static bool say(const io_sheet_photo *p)
{
    const io_pinhole *c = &p->sight.camera;
    if (p->st.code) {
        printf("%s\n", p->st.message);
        return false;
    }
    const double distance = sqrt(c->at[0] * c->at[0] + c->at[1] * c->at[1] + c->at[2] * c->at[2]);
    const unsigned faults = io_sheet_faults(p);
    printf("%s: %d of %d tags, %.0f degrees from straight above, %.1f sides away", p->path, p->sight.tags.count,
           IO_SHEET_TAGS, io_pinhole_tilt(c), distance);
    if (faults & IO_FAULT_MISSING) printf("; tags are missing: photograph the whole frame");
    if (faults & IO_FAULT_BLURRED) printf("; blurred (edges of %.1f pixels at 512): hold still, tap to focus", p->edge);
    if (faults & IO_FAULT_BURNT) printf("; burnt out (%.0f%% of the window): less exposure", 100 * p->burnt);
    if (faults & IO_FAULT_BENT)
        printf("; the tags are %.1f pixels (at 512) off a flat sheet: lay it flat", io_sheet_bend(p));
    if (faults & IO_FAULT_STEEP) printf("; too steep: stay within %.0f degrees", IO_SHEET_STEEP);
    printf(faults ? "\n" : "; fine\n");
    return !faults;
}

static int check(const command *c, char **paths, int count)
{
    io_sheet_set set;
    ts_status st = {0};
    const int64_t pixels = c->max_pixels > 0 ? c->max_pixels : IO_MAX_PIXELS_DEFAULT;
    if (io_sheet_set_read(paths, count, c->fov, pixels, 0, cl_interrupted, &set, &st) != TS_OK)
        return st.code == TS_INTERRUPTED ? cl_stopped("%s", st.message) : cl_failed("%s", st.message);
    bool fine = true;
    for (int i = 0; i < count; i++) fine = say(&set.photo[i]) && fine;
    if (set.good > 1 && io_sheet_apart(&set) < IO_SHEET_APART) {
        fine = false;
        printf("all photographs are from the same place (within %.0f degrees): go around the sample\n",
               ceil(io_sheet_apart(&set)));
    }
    if (set.good > 0 && !set.sure) cl_note("note: no photograph has a focal length in its EXIF: it is fitted");
    io_sheet_set_free(&set);
    return fine ? CL_OK : CL_FAILED;
}

static void say_failed(const char *message) { cl_failed("%s", message); }

static int check_operands(const command *c, char **word, int words)
{
    cl_operands all;
    ts_status st = {0};
    if (cl_operands_expand(word, words, say_failed, &all, &st) != TS_OK)
        return st.code == TS_INTERRUPTED ? cl_stopped("%s", st.message) : cl_failed("%s", st.message);
    int code = all.failed ? CL_FAILED : CL_OK;
    if (all.photos > IO_SOLVE_MOST) code = cl_usage("check: %d photographs at most, not %d", IO_SOLVE_MOST, all.photos);
    else if (all.photos > 0) {
        const int found = check(c, all.photo, all.photos);
        if (found) code = found;
    }
    cl_operands_free(&all);
    return code;
}

static int work(const command *c, char **word, int words)
{
    ts_status st = {0};
    if (words == 0) return cl_usage("what to do? sheet or check");
    if (!strcmp(word[0], "sheet")) {
        if (words > 1) return cl_usage("sheet: '%s' is one word too many", word[1]);
        if (c->fov > 0) return cl_usage("sheet reads no photograph: no --fov");
        if (c->max_pixels > 0) return cl_usage("sheet reads no photograph: no --max-pixels");
        if (!c->output) return cl_usage("sheet: where to? Give -o FILE.pdf or -o FILE.svg");
        const ts_code code = io_sheet_print(c->output, c->paper ? c->paper : io_papers, &st);
        return code == TS_INVALID ? cl_usage("%s", st.message) : code ? cl_failed("%s", st.message) : CL_OK;
    }
    if (strcmp(word[0], "check") != 0) return cl_usage("'%s' is neither sheet nor check", word[0]);
    if (c->output) return cl_usage("check writes no file: no -o");
    if (c->paper) return cl_usage("check reads either paper's sheet: no --paper");
    if (words == 1) return cl_usage("check: no photograph is given");
    for (int i = 1; i < words; i++)
        if (cl_check_name("check", word[i], &st) != TS_OK) return cl_usage("%s", st.message);
    return check_operands(c, word + 1, words - 1);
}

int main(int argc, char **argv)
{
    cl_open_streams();
    command c = {0};
    ts_status st = {0};
    int operands = argc;
    const int bad = cl_init("lgd-capture");
    if (bad) return bad;
    if (parse(argc, argv, &c, &operands, &st) != TS_OK) return cl_usage("%s", st.message);
    ts_threads_set((int)c.threads);
    cl_catch_interrupt();
    int code = CL_OK;
    if (c.help) print_help();
    else if (c.version) cl_print_version();
    else code = work(&c, argv + operands, argc - operands);
    return cl_finish(code);
}
