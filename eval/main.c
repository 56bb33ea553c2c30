/* lgd-eval: how far estimated maps are from known ones. */
#include "cli/cli.h"
#include "eval/multiview.h"
#include "eval/report.h"
#include "eval/set_ini.h"
#include "eval/sets.h"
#include "eval/sheet.h"
#include "infer/arguments.h"
#include "infer/model_path.h"
#include "nn/weights.h"
#include "render/error.h"
#include "tensor/cpu.h"
#include "tensor/threads.h"
#include <inttypes.h>
#include <stdlib.h>
#include <string.h>

enum { SETS_MAX = 64, IMAGES = 256, NOISE, SIZE, SEED, FAST, NORMAL, WORKFLOW, COLOUR, LPIPS, PATH_LENGTH = 4096, PICTURES = 128 /* in the report: some 40 MB */ };

static const lgd_argument arguments[] = {
    {'o', "output", "DIR", "write results.csv, summary.csv, results.json and report.html there (required)"},
    {'d', "set", "KIND:WHERE", "what to evaluate (required, may be repeated):\nprocedural:SEED,COUNT  generated materials\n"
        "strips:FOLDER  images of five panels: input, normal, diffuse, roughness, specular\nmaps:FOLDER  a folder of map folders\nmultiview:FOLDER  a capture, or a folder of them: 00.png, 01.png ..., camera_pos.txt,\nlight_pos.txt, image_size.txt, light_power.txt; 00.png is the input"},
    {NORMAL, "normal", "Y", "of map folders: opengl or directx (default: as set.ini, meta.txt or the file name says)"},
    {WORKFLOW, "workflow", "W", "of map folders: metallic or specular (default: likewise, or as the files are)"},
    {COLOUR, "colour", "C", "of map folders: srgb or linear (default: likewise, or sRGB)"},
    {'i', "iterations", "N", "refinement steps, 0 .. 1000 (default: as trained)"},
    {'m', "model", "FILE", "weights (default: $LGD_MODEL, or those installed or built with the program)"},
    {SIZE, "size", "N", "pixels of a side, 1 .. 4096 (default 256)"},
    {SEED, "seed", "N", "draws the renderings' lights and cameras, and the noise (default 1)"},
    {NOISE, "noise", "X", "sensor noise of the input picture, 0 = none .. 1 = a phone at night (default 0)"},
    {IMAGES, "images", NULL, "also write DIR/images/SET-MATERIAL.png: truth, R_0 and the last R_t in three rows"},
    {LPIPS, "lpips-weights", "TRUNK LINEAR", "measure LPIPS 0.1 too: torchvision's AlexNet and the lpips package's linear heads, two files (.pth or safetensors)"},
    {FAST, "fast", NULL, "no SSIM and FLIP, which take most of the time"},
    {'t', "threads", "N", "threads to use, 1 .. 1024; 0 = all that are allowed (default 0)"},
    {'q', "quiet", NULL, "no progress"},
    {'h', "help", NULL, "print this help"},
    {'V', "version", NULL, "print the version"},
    {0, NULL, NULL, NULL}};

typedef struct command {
    const char *out, *model, *lpips[2], *spec[SETS_MAX];
    int sets, iterations, threads, size;
    int64_t seed;
    double noise;
    io_map_convention told;
    bool images, fast, quiet, help, version;
} command;

static ts_code whole(const char *name, const char *text, int64_t lo, int64_t hi, int64_t *value, ts_status *st)
{
    if (cl_parse_int(text, lo, hi, value)) return TS_OK;
    return ts_fail(st, TS_INVALID, "--%s: '%s' is not a whole number in %lld .. %lld", name, text, (long long)lo, (long long)hi);
}

static ts_code parse(int argc, char **argv, command *c, ts_status *st)
{
    *c = (command){.iterations = -1, .size = 256, .seed = 1};
    const char *value = NULL;
    int key, operands = argc;
    int64_t n = 0;
    ts_code code = TS_OK;
    while (!code && !c->help && !c->version && (key = lgd_argument_next(argc, argv, arguments, &value, &operands, st)) != LGD_ARGUMENT_END) {
        switch (key) {
        case 'o': c->out = value; break;
        case 'm': c->model = value; break;
        case 'q': c->quiet = true; break;
        case 'h': c->help = true; break;
        case 'V': c->version = true; break;
        case IMAGES: c->images = true; break;
        case FAST: c->fast = true; break;
        case LPIPS:
            c->lpips[0] = value;
            if (!(c->lpips[1] = lgd_argument_second(argc, argv))) code = ts_fail(st, TS_INVALID, "--lpips-weights needs two files: TRUNK LINEAR");
            break;
        case SEED: code = whole("seed", value, 0, INT64_MAX, &c->seed, st); break;
        case 'd':
            if (c->sets == SETS_MAX) code = ts_fail(st, TS_INVALID, "--set: more than %d sets", SETS_MAX);
            else c->spec[c->sets++] = value;
            break;
        case 'i':
            code = whole("iterations", value, 0, 1000, &n, st);
            c->iterations = (int)n;
            break;
        case SIZE:
            code = whole("size", value, 1, 4096, &n, st);
            c->size = (int)n;
            break;
        case 't':
            code = whole("threads", value, 0, 1024, &n, st);
            c->threads = (int)n;
            break;
        case NORMAL:
            if (!ev_set_ini_key("normal", value, &c->told)) code = ts_fail(st, TS_INVALID, "--normal: '%s' is neither 'opengl' nor 'directx'", value);
            break;
        case WORKFLOW:
            if (!ev_set_ini_key("workflow", value, &c->told)) code = ts_fail(st, TS_INVALID, "--workflow: '%s' is neither 'metallic' nor 'specular'", value);
            break;
        case COLOUR:
            if (!ev_set_ini_key("colour", value, &c->told)) code = ts_fail(st, TS_INVALID, "--colour: '%s' is neither 'srgb' nor 'linear'", value);
            break;
        case NOISE:
            if (!cl_parse_real(value, 0, 1, &c->noise)) code = ts_fail(st, TS_INVALID, "--noise: '%s' is not a number in 0 .. 1", value);
            break;
        default: code = st->code;
        }
    }
    if (code || c->help || c->version) return code;
    if (operands < argc) return ts_fail(st, TS_INVALID, "'%s' is not an option; sets are given as --set KIND:WHERE", argv[operands]);
    if (c->sets == 0) return ts_fail(st, TS_INVALID, "no set is given: --set KIND:WHERE");
    if (!c->out || !*c->out) return ts_fail(st, TS_INVALID, "no output folder is given: -o DIR");
    return TS_OK;
}

static void print_help(void)
{
    puts("Usage: lgd-eval [options] --set KIND:WHERE... -o DIR\n"
         "Renders each known material under a flash (of a capture: takes its first picture), estimates its maps from that, and prints the RMSE of the maps (diffuse and\n"
         "specular in gamma space, roughness and normal as they are) and of renderings under other lights and cameras, the mean angle\n"
         "between the normals in degrees, and SSIM and FLIP (and LPIPS) of the renderings, for R_0 and after every refinement step (these\n"
         "three: for R_0 and the last). The same seed gives the same numbers, for any number of threads.\n");
    lgd_argument_help(arguments, stdout);
    puts("\nExit status: 0 done, 1 a material failed (the others are in the results) or nothing could be written, 2 wrong usage.");
}

/* Everything that one run holds. */
typedef struct run {
    const command *c;
    ev_set set[SETS_MAX];
    const char *set_name[SETS_MAX];
    nn_model *model;
    ev_lpips *lpips;
    ag_tape *tape;
    char model_name[PATH_LENGTH];
    ev_report report;
    io_material truth;
    io_capture capture;
    char name[128]; /* of the material at work */
    ev_row *row;
    double *seconds;
    float *image, *first, *last;
    cl_progress bar;
    int64_t done;
    int failed;
} run;

static ts_code one(run *r, int set, int i, ts_status *st)
{
    const command *c = r->c;
    const uint64_t identity = ev_set_identity(&r->set[set], i);
    rd_view views[RD_EVAL_VIEWS];
    ts_rng rng = ts_rng_make((uint64_t)c->seed, TS_STREAM_EVAL, identity);
    const bool capture = r->set[set].kind == EV_MULTIVIEW;
    if ((capture ? ev_set_load_capture(&r->set[set], i, c->size, &r->capture, st) : ev_set_load(&r->set[set], i, c->size, &r->truth, st)) != TS_OK)
        return st->code;
    snprintf(r->name, sizeof r->name, "%s", capture ? r->capture.name : r->truth.name);
    ev_case k;
    if (capture) {
        ev_capture_input(&r->capture, r->image);
        k = ev_case_of_capture(&r->capture, r->image, !c->fast);
    } else {
        rd_eval_views(&rng, RD_EVAL_VIEWS, views);
        ev_photograph(&r->truth, (float)c->noise, (uint64_t)c->seed, identity, r->image);
        k = ev_case_of_maps(&r->truth, r->image, views, !c->fast);
    }
    k.lpips = r->lpips;
    ts_code code = ev_measure(r->tape, r->model, &k, r->report.steps, r->row, r->seconds, r->first, r->last, st);
    if (!code && c->images) {
        char path[PATH_LENGTH];
        if (snprintf(path, sizeof path, "%s/images/%d-%s.png", c->out, set + 1, r->name) >= (int)sizeof path)
            code = ts_fail(st, TS_INVALID, "%s: the name is too long", c->out);
        else code = ev_sheet_write(path, &k, r->first, r->last, st);
    }
    if (code) return ts_context(st, "%s: %s", r->set[set].spec, r->name);
    unsigned char *png = NULL;
    size_t png_size = 0;
    if (r->report.results < PICTURES) code = ev_sheet_png(&k, r->last, &png, &png_size, st);
    return code ? code : ev_report_add(&r->report, set, r->name, r->row, r->seconds, png, png_size, st);
}

static int evaluate(run *r)
{
    const command *c = r->c;
    int64_t total = 0;
    ts_status st = {0};
    for (int s = 0; s < c->sets; s++) total += r->set[s].count;
    r->bar = cl_progress_start("material", total);
    for (int s = 0; s < c->sets; s++)
        for (int i = 0; i < r->set[s].count; i++) {
            if (cl_interrupted()) {
                cl_progress_end(&r->bar);
                return cl_failed("interrupted after %" PRId64 " of %" PRId64 " materials: no results are written", r->done, total);
            }
            st = (ts_status){0};
            if (one(r, s, i, &st) != TS_OK) {
                cl_progress_end(&r->bar);
                cl_failed("%s", st.message);
                r->failed++;
            }
            r->done++;
            if (!c->quiet) cl_progress_show(&r->bar, r->done, r->name);
        }
    cl_progress_end(&r->bar);
    st = (ts_status){0};
    if (r->report.results == 0) return cl_failed("no material could be evaluated");
    if (ev_report_write(&r->report, c->out, &st) != TS_OK) return cl_failed("%s", st.message);
    ev_report_print(&r->report, stdout);
    if (r->failed > 0) return cl_failed("%d of %" PRId64 " materials failed: they are not in the means", r->failed, total);
    return CL_OK;
}

/* Folders, weights and memory; false with st. */
static bool prepare(run *r, ts_status *st)
{
    const command *c = r->c;
    char path[PATH_LENGTH];
    if (cl_make_folder(c->out, st) != TS_OK) return false;
    if (snprintf(path, sizeof path, "%s/images", c->out) >= (int)sizeof path) return ts_fail(st, TS_INVALID, "%s: the name is too long", c->out), false;
    if (c->images && cl_make_folder(path, st) != TS_OK) return false;
    if (lgd_model_path(c->model, "single", path, st) != TS_OK || !(r->model = nn_model_load(path, st)) || !(r->tape = ag_tape_create(false, st))) return false;
    ag_freeze(r->tape, true);
    if (c->lpips[0] && c->size < EV_LPIPS_SIDE) return ts_fail(st, TS_UNSUPPORTED, "LPIPS needs pictures of at least %d x %d pixels: --size", EV_LPIPS_SIDE, EV_LPIPS_SIDE), false;
    if (c->lpips[0] && !(r->lpips = ev_lpips_load(c->lpips[0], c->lpips[1], st))) return false;
    const int steps = c->iterations < 0 ? r->model->arch.iterations : c->iterations;
    if (steps > 0 && r->model->arch.h_width == 0) return ts_fail(st, TS_UNSUPPORTED, "%s: has no refiner: only --iterations 0 is possible", path), false;
    r->report = (ev_report){.steps = steps, .sets = c->sets, .set_name = r->set_name, .size = c->size, .threads = ts_threads(), .isa = ts_isa_name(ts_isa_now())};
    const char *slash = strrchr(path, '/'); /* where it lay says nothing to whom the report is sent */
    snprintf(r->model_name, sizeof r->model_name, "%s", slash ? slash + 1 : path);
    r->report.model = r->model_name;
    const size_t pixels = (size_t)c->size * (size_t)c->size;
    r->row = calloc((size_t)steps + 1, sizeof *r->row);
    r->seconds = calloc((size_t)steps + 1, sizeof *r->seconds);
    r->image = malloc(pixels * 3 * sizeof(float));
    r->first = malloc(pixels * MAP_CHANNELS * sizeof(float));
    r->last = malloc(pixels * MAP_CHANNELS * sizeof(float));
    if (!r->row || !r->seconds || !r->image || !r->first || !r->last) return ts_fail(st, TS_NOMEM, "out of memory for %d x %d pixels", c->size, c->size), false;
    return true;
}

static int work(const command *c)
{
    run *r = calloc(1, sizeof *r);
    if (!r) return cl_failed("out of memory");
    ts_status st = {0};
    int code = CL_OK;
    r->c = c;
    for (int s = 0; s < c->sets && code == CL_OK; s++) {
        if (ev_set_open(c->spec[s], &c->told, &r->set[s], &st) == TS_INVALID) code = cl_usage("%s", st.message);
        else if (st.code) code = cl_failed("%s", st.message);
        r->set_name[s] = c->spec[s];
    }
    ts_threads_set(c->threads);
    if (code == CL_OK) code = prepare(r, &st) ? evaluate(r) : cl_failed("%s", st.message);
    for (int s = 0; s < c->sets; s++) ev_set_close(&r->set[s]);
    ev_report_free(&r->report);
    io_material_free(&r->truth);
    io_capture_free(&r->capture);
    free(r->row);
    free(r->seconds);
    free(r->image);
    free(r->first);
    free(r->last);
    ag_tape_destroy(&r->tape);
    nn_model_free(&r->model);
    ev_lpips_free(&r->lpips);
    free(r);
    return code;
}

int main(int argc, char **argv)
{
    command c;
    ts_status st = {0};
    const int bad = cl_init("lgd-eval");
    if (bad) return bad;
    if (parse(argc, argv, &c, &st) != TS_OK) return cl_usage("%s", st.message);
    cl_catch_interrupt();
    int code = CL_OK;
    if (c.help) print_help();
    else if (c.version) cl_print_version();
    else code = work(&c);
    return cl_finish(code);
}
