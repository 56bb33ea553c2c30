/* lgd-data: procedural materials as map folders, strips, photographs or a contact sheet, and how they compare with
 * others' materials. */
#include "cli/camera.h"
#include "cli/arguments.h"
#include "cli/cli.h"
#include "cli/data/histograms.h"
#include "cli/data/pictures.h"
#include "cli/data/sheet_captures.h"
#include "data/materials/compare.h"
#include "data/sheet.h"
#include "render/render.h"
#include "tensor/team.h"
#include "tensor/threads.h"
#include <errno.h>
#include <math.h>
#include <pthread.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

typedef enum format { FORMAT_NONE, FORMAT_FOLDERS, FORMAT_STRIPS, FORMAT_CAPTURES, FORMAT_SHEETS } format;

typedef struct options {
    const char *output, *testdata;
    io_procedural procedural;
    int64_t first, count, size, threads, quality, width; /* count and size 0: not given */
    io_camera camera;
    format format;
    bool sheet, photographs, statistics, histograms;
} options;

enum {
    OPT_SEED = 256,
    OPT_FIRST,
    OPT_COUNT,
    OPT_SIZE,
    OPT_FAMILIES,
    OPT_HUES,
    OPT_RELIEF,
    OPT_BLEND,
    OPT_UNEVEN,
    OPT_HOMOGENEOUS,
    OPT_FORMAT,
    OPT_SHEET,
    OPT_PHOTOGRAPHS,
    OPT_QUALITY,
    OPT_WIDTH,
    OPT_STATISTICS,
    OPT_HISTOGRAMS,
    OPT_TESTDATA,
    OPT_THREADS,
    OPT_HELP,
    OPT_VERSION,
    OPT_CAMERA /* and more: cl_camera_options */
};

static const struct option plain_options[] = {{"output", required_argument, NULL, 'o'},
                                              {"seed", required_argument, NULL, OPT_SEED},
                                              {"first", required_argument, NULL, OPT_FIRST},
                                              {"count", required_argument, NULL, OPT_COUNT},
                                              {"size", required_argument, NULL, OPT_SIZE},
                                              {"families", required_argument, NULL, OPT_FAMILIES},
                                              {"hues", required_argument, NULL, OPT_HUES},
                                              {"relief", required_argument, NULL, OPT_RELIEF},
                                              {"blend", required_argument, NULL, OPT_BLEND},
                                              {"uneven", required_argument, NULL, OPT_UNEVEN},
                                              {"homogeneous", required_argument, NULL, OPT_HOMOGENEOUS},
                                              {"format", required_argument, NULL, OPT_FORMAT},
                                              {"contact-sheet", no_argument, NULL, OPT_SHEET},
                                              {"photographs", no_argument, NULL, OPT_PHOTOGRAPHS},
                                              {"quality", required_argument, NULL, OPT_QUALITY},
                                              {"photo-width", required_argument, NULL, OPT_WIDTH},
                                              {"statistics", no_argument, NULL, OPT_STATISTICS},
                                              {"histograms", no_argument, NULL, OPT_HISTOGRAMS},
                                              {"testdata", required_argument, NULL, OPT_TESTDATA},
                                              {"threads", required_argument, NULL, OPT_THREADS},
                                              {"help", no_argument, NULL, OPT_HELP},
                                              {"version", no_argument, NULL, OPT_VERSION},
                                              {NULL, 0, NULL, 0}};

static void print_help(void)
{
    printf(
        "Usage: lgd-data [options] -o DIR\n"
        "  or:  lgd-data --statistics --testdata DIR [options]\n"
        "Writes procedural materials number FIRST .. FIRST+COUNT-1 of the sequence of SEED.\n\n"
        "What to write (the default is --format folders):\n"
        "  -o, --output DIR      output folder; created when absent\n"
        "      --format FORMAT   folders: DIR/NAME/ with diffuse.png, specular.png, roughness.png, normal.png, "
        "maps.exr;\n"
        "                        strips: DIR/NAME.png, five panels: photograph, normal, diffuse, roughness, specular;\n"
        "                        captures: DIR/NAME/ with nine photographs 00.png .. 08.png and their lights and "
        "cameras\n"
        "                        sheet-captures: DIR/NAME/ with maps/, five photographs of the material in the window "
        "of\n"
        "                        lgd-capture's sheet, photo_1.jpg .. photo_5.jpg, and exact/: the same without faults\n"
        "      --photographs     DIR/NAME.jpg: renderings under the flash, with sensor noise, blur and JPEG\n"
        "      --contact-sheet   DIR/contact-sheet.png: a row for each family, with its name\n"
        "      --statistics      print a table that compares the maps with those of --testdata\n"
        "      --histograms      DIR/histograms.svg and .csv: histograms of the maps and of those of --testdata\n\n"
        "Which materials:\n"
        "      --seed N          default 1\n"
        "      --first N         default 0\n"
        "      --count N         default 16; contact sheet 3 for each family; statistics and histograms 512\n"
        "      --size N          8 .. 2048 pixels, default 256; contact sheet, statistics and histograms 128\n"
        "      --families LIST   all (the default), classic (the first seventeen), or some of: ");
    for (int i = 0; i < io_family_count(); i++)
        printf("%s%s%s", i ? i % 8 ? ", " : "," : "", i % 8 ? "" : "\n                        ", io_family_name(i));
    printf("\n"
           "      --hues X          share of the materials with other hues, 0 .. 1 (default 0)\n"
           "      --relief X        share of the materials with another relief, 0 .. 1 (default 0)\n"
           "      --blend X         share of the materials that are a mean of two, 0 .. 1 (default 0)\n"
           "      --uneven X        share of the materials that do not lie flat, 0 .. 1 (default 0)\n"
           "      --homogeneous X   share of the materials that are the same all over the patch, 0 .. 1 (default 0)\n");
    printf("\nPhotographs, largest values of what each draws:\n");
    for (int i = 0; i < CL_CAMERA_OPTIONS; i++) {
        io_camera least = cl_camera_default;
        const cl_camera_option *k = &cl_camera_options[i];
        printf("      --%s X%*s%s, 0 .. %g (default %g)\n", k->name, 15 - (int)strlen(k->name), "", k->help, k->most,
               (double)*cl_camera_value(&least, i));
    }
    printf("\nOther:\n"
           "      --quality N       of photographs' JPEG, 1 .. 100 (default 90)\n"
           "      --photo-width N   of sheet-captures, 400 .. 8000 pixels (default 4000)\n"
           "      --testdata DIR    folder with maps/ (map folders) and strips/ to compare with\n"
           "      --threads N       number of threads (default: as many as the process may use)\n"
           "      --help, --version\n");
}

static int parse_families(char *list, uint64_t *families)
{
    *families = 0;
    char *rest = NULL;
    for (char *name = strtok_r(list, ",", &rest); name; name = strtok_r(NULL, ",", &rest)) {
        const uint64_t bits = io_family_mask(name);
        if (!bits) return cl_usage("--families: no family is called '%s' (--help lists them)", name);
        *families |= bits;
    }
    return *families ? CL_OK : cl_usage("--families: the list is empty");
}

static int parse_number(const char *option, const char *text, int64_t lo, int64_t hi, int64_t *value)
{
    return cl_parse_int(text, lo, hi, value)
        ? CL_OK
        : cl_usage("--%s: '%s' is not a whole number from %lld to %lld", option, text, (long long)lo, (long long)hi);
}

static int parse_share(const char *option, const char *text, double hi, float *value)
{
    double v;
    if (!cl_parse_real(text, 0, hi, &v)) return cl_usage("--%s: '%s' is not a number from 0 to %g", option, text, hi);
    *value = (float)v;
    return CL_OK;
}

static int parse_options(int argc, char **argv, options *o)
{
    int code = CL_OK, c;
    int64_t seed = 1;
    enum { PLAIN = sizeof plain_options / sizeof *plain_options };
    struct option long_options[PLAIN + CL_CAMERA_OPTIONS];
    for (int i = 0; i < CL_CAMERA_OPTIONS; i++)
        long_options[i] = (struct option){cl_camera_options[i].name, required_argument, NULL, OPT_CAMERA + i};
    memcpy(long_options + CL_CAMERA_OPTIONS, plain_options, sizeof plain_options);
    ts_status st;
    while (code == CL_OK && (c = cl_option_next(argc, argv, ":o:", long_options, &st)) != CL_ARGUMENT_END) switch (c) {
        case 'o': o->output = optarg; break;
        case OPT_SEED: code = parse_number("seed", optarg, 0, INT64_MAX, &seed); break;
        case OPT_FIRST: code = parse_number("first", optarg, 0, INT64_C(1) << 60, &o->first); break;
        case OPT_COUNT: code = parse_number("count", optarg, 1, 10000000, &o->count); break;
        case OPT_SIZE: code = parse_number("size", optarg, 8, 2048, &o->size); break;
        case OPT_FAMILIES: code = parse_families(optarg, &o->procedural.families); break;
        case OPT_HUES: code = parse_share("hues", optarg, 1, &o->procedural.hues); break;
        case OPT_BLEND: code = parse_share("blend", optarg, 1, &o->procedural.blend); break;
        case OPT_UNEVEN: code = parse_share("uneven", optarg, 1, &o->procedural.uneven); break;
        case OPT_HOMOGENEOUS: code = parse_share("homogeneous", optarg, 1, &o->procedural.homogeneous); break;
        case OPT_RELIEF: code = parse_share("relief", optarg, 1, &o->procedural.relief); break;
        case OPT_FORMAT:
            if (!strcmp(optarg, "folders")) o->format = FORMAT_FOLDERS;
            else if (!strcmp(optarg, "strips")) o->format = FORMAT_STRIPS;
            else if (!strcmp(optarg, "captures")) o->format = FORMAT_CAPTURES;
            else if (!strcmp(optarg, "sheet-captures")) o->format = FORMAT_SHEETS;
            else
                code = cl_usage("--format: '%s' is none of 'folders', 'strips', 'captures' and 'sheet-captures'",
                                optarg);
            break;
        case OPT_SHEET: o->sheet = true; break;
        case OPT_PHOTOGRAPHS: o->photographs = true; break;
        case OPT_QUALITY: code = parse_number("quality", optarg, 1, 100, &o->quality); break;
        case OPT_WIDTH: code = parse_number("photo-width", optarg, 400, 8000, &o->width); break;
        case OPT_STATISTICS: o->statistics = true; break;
        case OPT_HISTOGRAMS: o->histograms = true; break;
        case OPT_TESTDATA: o->testdata = optarg; break;
        case OPT_THREADS: code = parse_number("threads", optarg, 1, 1024, &o->threads); break;
        case OPT_HELP: print_help(); exit(cl_finish(CL_OK));
        case OPT_VERSION: cl_print_version(); exit(cl_finish(CL_OK));
        case CL_ARGUMENT_BAD: code = cl_usage("%s", st.message); break;
        default: { /* of the camera's */
            const cl_camera_option *k = &cl_camera_options[c - OPT_CAMERA];
            code = parse_share(k->name, optarg, k->most, cl_camera_value(&o->camera, c - OPT_CAMERA));
        }
        }
    if (code) return code;
    if (optind < argc) return cl_usage("'%s' is not an option", argv[optind]);
    bool writes = o->format || o->sheet || o->photographs || o->histograms;
    if (!o->statistics && !writes) o->format = FORMAT_FOLDERS;
    if (!o->output && (writes || !o->statistics)) return cl_usage("where to? Give -o DIR");
    const bool compares = o->statistics || o->histograms;
    if (compares && !o->testdata)
        return cl_usage("%s needs --testdata DIR", o->statistics ? "--statistics" : "--histograms");
    if (o->testdata && !compares) return cl_usage("--testdata is for --statistics and --histograms");
    const float narrow = o->camera.fov_min, wide = o->camera.fov_max;
    if ((narrow != 0 || wide != 0) && (narrow < 5 || wide < narrow))
        return cl_usage("--fov-min and --fov-max go together: 5 <= fov-min <= fov-max");
    o->procedural.seed = (uint64_t)seed;
    return CL_OK;
}

static ts_code make_path(char path[4096], const options *o, const char *name, const char *suffix, ts_status *st)
{
    if (snprintf(path, 4096, "%s/%s%s", o->output, name, suffix) >= 4096)
        return ts_fail(st, TS_INVALID, "%s: the path is too long", o->output);
    return TS_OK;
}

/* One material and its photograph, to the files that were asked for. */
static ts_code write_material(const options *o, uint64_t index, io_material *m, io_image *photo, ts_status *st)
{
    char path[4096];
    rd_view flash = rd_flash();
    io_procedural_make(&o->procedural, index, m);
    ts_code code = TS_OK;
    if (o->format == FORMAT_FOLDERS) {
        code = make_path(path, o, m->name, "", st);
        if (!code) code = cl_make_folder(path, st);
        if (!code) code = io_write_maps(path, m, IO_MAPS_ALL, false, st);
    }
    if (!code && o->format == FORMAT_STRIPS) {
        rd_render(rd_grid_full(m->size), m->maps, MAP_CHANNELS, &flash, true, photo->data);
        code = make_path(path, o, m->name, ".png", st);
        if (!code) code = io_write_strip(path, m, photo, st);
    }
    if (!code && o->format == FORMAT_CAPTURES) {
        code = make_path(path, o, m->name, "", st);
        if (!code) code = cl_make_folder(path, st);
        if (!code) code = cl_write_capture(path, m, st);
    }
    if (!code && o->format == FORMAT_SHEETS) {
        code = make_path(path, o, m->name, "/maps", st);
        if (!code) code = cl_make_folder(path, st);
        if (!code) code = io_write_maps(path, m, IO_MAPS_ALL, false, st);
        if (!code) code = make_path(path, o, m->name, "", st);
        if (!code)
            code = cl_write_sheet_captures(path, m, o->procedural.seed, index, (int)o->width, (int)o->quality, st);
    }
    if (!code && o->photographs) {
        cl_photograph(&o->camera, o->procedural.seed, index, &flash, m->size, m->maps, photo->data);
        code = make_path(path, o, m->name, ".jpg", st);
        if (!code) code = io_write_jpeg(path, photo, (int)o->quality, st);
    }
    return code;
}

typedef ts_code task(const options *o, int64_t number, io_material *m, io_image *photo, io_sheet *sheet, ts_status *st);

static ts_code write_task(const options *o, int64_t number, io_material *m, io_image *photo, io_sheet *sheet,
                          ts_status *st)
{
    (void)sheet;
    return write_material(o, (uint64_t)(o->first + number), m, photo, st);
}

static int row_family(const options *o, int row)
{
    for (int i = 0; i < io_family_count(); i++)
        if ((!o->procedural.families || o->procedural.families >> i & 1) && row-- == 0) return i;
    return 0;
}

static ts_code sheet_task(const options *o, int64_t number, io_material *m, io_image *photo, io_sheet *sheet,
                          ts_status *st)
{
    (void)st;
    int column = (int)(number % sheet->columns), row = (int)(number / sheet->columns);
    io_procedural p = o->procedural;
    p.families = UINT64_C(1) << row_family(o, row);
    rd_view flash = rd_flash();
    io_procedural_make(&p, (uint64_t)(o->first + number), m);
    rd_render(rd_grid_full(m->size), m->maps, MAP_CHANNELS, &flash, true, photo->data);
    io_sheet_put(sheet, column, row, m->maps, photo->data);
    return TS_OK;
}

typedef struct running {
    const options *o;
    task *f;
    int size;
    io_sheet *sheet;
    pthread_mutex_t *lock; /* of what follows */
    int64_t *done, *failed;
    cl_progress *progress;
    ts_status *st;
} running;

static void run_tasks(const void *job, ts_queue *queue)
{
    const running *r = job;
    ts_status mine = {0};
    io_material m = {0};
    io_image photo = {0};
    int64_t i, end;
    if (!ts_next(queue, &i, &end)) return;
    ts_code ready = io_material_create(&m, r->size, &mine);
    if (!ready) ready = io_image_create(&photo, r->size, r->size, 3, &mine);
    do {
        pthread_mutex_lock(r->lock);
        const bool skip = *r->failed < i || cl_interrupted();
        pthread_mutex_unlock(r->lock);
        if (skip) continue;
        const ts_code code = ready ? ready : r->f(r->o, i, &m, &photo, r->sheet, &mine);
        pthread_mutex_lock(r->lock);
        if (code && i < *r->failed) {
            *r->failed = i;
            *r->st = mine;
        }
        cl_progress_show(r->progress, ++*r->done, NULL);
        pthread_mutex_unlock(r->lock);
    } while (ts_next(queue, &i, &end));
    io_material_free(&m);
    io_image_free(&photo);
}

/* Runs count tasks on all threads; the first failure (in the order of their numbers) is reported. */
static ts_code run(const options *o, const char *what, task *f, int64_t count, int size, io_sheet *sheet, ts_status *st)
{
    int64_t done = 0, failed = count;
    pthread_mutex_t lock = PTHREAD_MUTEX_INITIALIZER;
    cl_progress progress = cl_progress_start(what, count);
    ts_share_tasks(0, count, 1, run_tasks, &(running){o, f, size, sheet, &lock, &done, &failed, &progress, st});
    cl_progress_end(&progress);
    if (st->code == TS_OK && cl_interrupted())
        ts_fail(st, TS_INTERRUPTED, "interrupted after %lld of %lld materials", (long long)done, (long long)count);
    return st->code;
}

static ts_code make_sheet(const options *o, ts_status *st)
{
    int rows = 0;
    for (int i = 0; i < io_family_count(); i++) rows += !o->procedural.families || o->procedural.families >> i & 1;
    int64_t columns = o->count ? (o->count + rows - 1) / rows : 3;
    io_sheet sheet = {0};
    char path[4096];
    ts_code code = columns > 1000
        ? ts_fail(st, TS_INVALID, "a contact sheet of %lld materials is too large: ask for fewer", (long long)o->count)
        : TS_OK;
    if (!code) code = io_sheet_create(&sheet, (int)columns, rows, o->size ? (int)o->size : 128, st);
    for (int i = 0, row = 0; !code && i < io_family_count(); i++)
        if (!o->procedural.families || o->procedural.families >> i & 1) io_sheet_name(&sheet, row++, io_family_name(i));
    if (!code) code = run(o, "contact sheet", sheet_task, columns * rows, sheet.size, &sheet, st);
    if (!code) code = make_path(path, o, "contact-sheet", ".png", st);
    if (!code) code = io_write_png(path, &sheet.image, 8, true, st);
    io_image_free(&sheet.image);
    return code;
}

static ts_code compare(const options *o, ts_status *st)
{
    const int count = o->count ? (int)o->count : 512, size = o->size ? (int)o->size : 128;
    return io_compare(&o->procedural, (uint64_t)o->first, count, o->testdata, size, stdout, st);
}

static ts_code make_histograms(const options *o, ts_status *st)
{
    const int count = o->count ? (int)o->count : 512, size = o->size ? (int)o->size : 128;
    return cl_write_histograms(o->output, &o->procedural, (uint64_t)o->first, count, o->testdata, size, st);
}

int main(int argc, char **argv)
{
    cl_open_streams();
    options o = {.quality = 90, .width = 4000, .camera = cl_camera_default};
    ts_status st = {0};
    int code = cl_init("lgd-data");
    if (!code) code = parse_options(argc, argv, &o);
    if (code) return code;
    ts_threads_set((int)o.threads);
    cl_catch_interrupt();
    const bool there = o.output && access(o.output, F_OK) == 0;
    if (o.output) cl_make_folder(o.output, &st);
    if (!st.code && (o.format || o.photographs))
        run(&o, "materials", write_task, o.count ? o.count : 16, o.size ? (int)o.size : 256, NULL, &st);
    if (!st.code && o.sheet) make_sheet(&o, &st);
    if (!st.code && o.statistics) compare(&o, &st);
    if (!st.code && o.histograms) make_histograms(&o, &st);
    if (o.output && !there) rmdir(o.output); /* nothing came into it, or it stays */
    if (st.code == TS_INTERRUPTED) return cl_finish(cl_stopped("%s", st.message));
    return cl_finish(st.code ? cl_failed("%s", st.message) : CL_OK);
}
