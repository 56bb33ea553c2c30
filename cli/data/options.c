#include "cli/data/options.h"
#include "cli/arguments.h"
#include "cli/cli.h"
#include <stddef.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* Of the materials, those that are changed. */
static const struct {
    const char *name, *help;
    size_t at; /* in io_procedural */
} shares[] = {{"hues", "with other hues", offsetof(io_procedural, hues)},
              {"darker", "with darker diffuse colours", offsetof(io_procedural, darker)},
              {"relief", "with another relief", offsetof(io_procedural, relief)},
              {"blend", "that are a mean of two", offsetof(io_procedural, blend)},
              {"uneven", "that do not lie flat", offsetof(io_procedural, uneven)},
              {"closer", "seen from up to four times as near", offsetof(io_procedural, closer)},
              {"homogeneous", "that are the same all over the patch", offsetof(io_procedural, homogeneous)},
              {"smoother", "with smoother surfaces", offsetof(io_procedural, smoother)},
              {"steeper", "with a steeper relief", offsetof(io_procedural, steeper)},
              {"plain", "of one gloss, with hardly any relief", offsetof(io_procedural, plain)},
              {"collected", "that are parts of --collection's", offsetof(io_procedural, collected)}};

enum {
    SHARES = sizeof shares / sizeof *shares,
    OPT_SEED = 256,
    OPT_FIRST,
    OPT_COUNT,
    OPT_SIZE,
    OPT_FAMILIES,
    OPT_FORMAT,
    OPT_SHEET,
    OPT_PHOTOGRAPHS,
    OPT_QUALITY,
    OPT_WIDTH,
    OPT_STATISTICS,
    OPT_HISTOGRAMS,
    OPT_TESTDATA,
    OPT_COLLECTION,
    OPT_THREADS,
    OPT_SHARE,                      /* and more: shares */
    OPT_CAMERA = OPT_SHARE + SHARES /* and more: cl_camera_options */
};

static const struct option plain_options[] = {{"output", required_argument, NULL, 'o'},
                                              {"seed", required_argument, NULL, OPT_SEED},
                                              {"first", required_argument, NULL, OPT_FIRST},
                                              {"count", required_argument, NULL, OPT_COUNT},
                                              {"size", required_argument, NULL, OPT_SIZE},
                                              {"families", required_argument, NULL, OPT_FAMILIES},
                                              {"format", required_argument, NULL, OPT_FORMAT},
                                              {"contact-sheet", no_argument, NULL, OPT_SHEET},
                                              {"photographs", no_argument, NULL, OPT_PHOTOGRAPHS},
                                              {"quality", required_argument, NULL, OPT_QUALITY},
                                              {"photo-width", required_argument, NULL, OPT_WIDTH},
                                              {"statistics", no_argument, NULL, OPT_STATISTICS},
                                              {"histograms", no_argument, NULL, OPT_HISTOGRAMS},
                                              {"testdata", required_argument, NULL, OPT_TESTDATA},
                                              {"collection", required_argument, NULL, OPT_COLLECTION},
                                              {"threads", required_argument, NULL, OPT_THREADS},
                                              {"help", no_argument, NULL, 'h'},
                                              {"version", no_argument, NULL, 'V'},
                                              {NULL, 0, NULL, 0}};

static void print_help(void)
{
    printf(
        "Usage: lgd-data [options] -o DIR\n"
        "  or:  lgd-data --statistics --testdata DIR [options]\n"
        "  or:  lgd-data --histograms --testdata DIR [options] -o DIR\n"
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
    printf("\n");
    for (int i = 0; i < SHARES; i++)
        printf("      --%s X%*sshare of the materials %s, 0 .. 1 (default 0)\n", shares[i].name,
               14 - (int)strlen(shares[i].name), "", shares[i].help);
    printf("      --collection DIR  a folder of map folders of your own\n");
    printf("\nPhotographs, largest values of what each draws:\n");
    for (int i = 0; i < CL_CAMERA_OPTIONS; i++) {
        io_camera least = cl_camera_default;
        const cl_camera_option *k = &cl_camera_options[i];
        printf("      --%s X%*s%s, 0 .. %g (default %g)\n", k->name, 15 - (int)strlen(k->name), "", k->help, k->most,
               (double)*cl_camera_value(&least, i));
    }
    printf("\nOther:\n"
           "      --quality N       of the JPEG of photographs and sheet-captures, 1 .. 100 (default 90)\n"
           "      --photo-width N   of sheet-captures, 400 .. 8000 pixels (default 4000)\n"
           "      --testdata DIR    folder with maps/ (map folders) and strips/ to compare with\n"
           "      --threads N       number of threads, 1 .. 1024; 0 = all that are allowed (default 0)\n"
           "  -h, --help            print this help\n"
           "  -V, --version         print the version\n\n"
           "Exit status: 0 done, 1 something cannot be read or written, 2 wrong usage, 130 interrupted.\n");
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

static int take_name(const char *option, const char *name, const char **value)
{
    ts_status st;
    *value = name;
    return cl_check_name(option, name, &st) == TS_OK ? CL_OK : cl_usage("%s", st.message);
}

static int parse_share(const char *option, const char *text, double hi, float *value)
{
    double v;
    if (!cl_parse_real(text, 0, hi, &v)) return cl_usage("--%s: '%s' is not a number from 0 to %g", option, text, hi);
    *value = (float)v;
    return CL_OK;
}

/* Options of which nothing is made. of_camera: one of cl_camera_options, or NULL. */
static int check_uses(const cl_data_options *o, const char *of_camera, bool quality, bool width)
{
    const bool sheets = o->format == CL_FORMAT_SHEETS;
    if (of_camera && !o->photographs) return cl_usage("--%s is for --photographs", of_camera);
    if (quality && !o->photographs && !sheets)
        return cl_usage("--quality is for --photographs and --format sheet-captures");
    if (width && !sheets) return cl_usage("--photo-width is for --format sheet-captures");
    return CL_OK;
}

int cl_data_options_read(int argc, char **argv, cl_data_options *o)
{
    int code = CL_OK, c;
    int64_t seed = 1;
    bool quality = false, width = false;
    const char *of_camera = NULL;
    enum { PLAIN = sizeof plain_options / sizeof *plain_options };
    struct option long_options[SHARES + CL_CAMERA_OPTIONS + PLAIN];
    for (int i = 0; i < SHARES; i++)
        long_options[i] = (struct option){shares[i].name, required_argument, NULL, OPT_SHARE + i};
    for (int i = 0; i < CL_CAMERA_OPTIONS; i++)
        long_options[SHARES + i] = (struct option){cl_camera_options[i].name, required_argument, NULL, OPT_CAMERA + i};
    memcpy(long_options + SHARES + CL_CAMERA_OPTIONS, plain_options, sizeof plain_options);
    ts_status st;
    while (code == CL_OK && (c = cl_option_next(argc, argv, ":o:hV", long_options, &st)) != CL_ARGUMENT_END)
        switch (c) {
        case 'o': code = take_name("-o", optarg, &o->output); break;
        case OPT_SEED: code = parse_number("seed", optarg, 0, INT64_MAX, &seed); break;
        case OPT_FIRST: code = parse_number("first", optarg, 0, INT64_C(1) << 60, &o->first); break;
        case OPT_COUNT: code = parse_number("count", optarg, 1, 10000000, &o->count); break;
        case OPT_SIZE: code = parse_number("size", optarg, 8, 2048, &o->size); break;
        case OPT_FAMILIES: code = parse_families(optarg, &o->procedural.families); break;
        case OPT_FORMAT:
            if (!strcmp(optarg, "folders")) o->format = CL_FORMAT_FOLDERS;
            else if (!strcmp(optarg, "strips")) o->format = CL_FORMAT_STRIPS;
            else if (!strcmp(optarg, "captures")) o->format = CL_FORMAT_CAPTURES;
            else if (!strcmp(optarg, "sheet-captures")) o->format = CL_FORMAT_SHEETS;
            else
                code = cl_usage("--format: '%s' is none of 'folders', 'strips', 'captures' and 'sheet-captures'",
                                optarg);
            break;
        case OPT_SHEET: o->sheet = true; break;
        case OPT_PHOTOGRAPHS: o->photographs = true; break;
        case OPT_QUALITY:
            quality = true;
            code = parse_number("quality", optarg, 1, 100, &o->quality);
            break;
        case OPT_WIDTH:
            width = true;
            code = parse_number("photo-width", optarg, 400, 8000, &o->width);
            break;
        case OPT_STATISTICS: o->statistics = true; break;
        case OPT_HISTOGRAMS: o->histograms = true; break;
        case OPT_TESTDATA: code = take_name("--testdata", optarg, &o->testdata); break;
        case OPT_COLLECTION: code = take_name("--collection", optarg, &o->collection); break;
        case OPT_THREADS: code = parse_number("threads", optarg, 0, 1024, &o->threads); break;
        case 'h': print_help(); exit(cl_finish(CL_OK));
        case 'V': cl_print_version(); exit(cl_finish(CL_OK));
        case CL_ARGUMENT_BAD: code = cl_usage("%s", st.message); break;
        default: { /* a share, or of the camera's */
            if (c < OPT_CAMERA) {
                const int i = c - OPT_SHARE;
                code = parse_share(shares[i].name, optarg, 1, (float *)((char *)&o->procedural + shares[i].at));
                break;
            }
            const cl_camera_option *k = &cl_camera_options[c - OPT_CAMERA];
            of_camera = k->name;
            code = parse_share(k->name, optarg, k->most, cl_camera_value(&o->camera, c - OPT_CAMERA));
        }
        }
    if (code) return code;
    if (optind < argc) return cl_usage("'%s' is not an option", argv[optind]);
    bool writes = o->format || o->sheet || o->photographs || o->histograms;
    if (!o->statistics && !writes) o->format = CL_FORMAT_FOLDERS;
    if (!o->output && (writes || !o->statistics)) return cl_usage("where to? Give -o DIR");
    const bool compares = o->statistics || o->histograms;
    if (compares && !o->testdata)
        return cl_usage("%s needs --testdata DIR", o->statistics ? "--statistics" : "--histograms");
    if (o->testdata && !compares) return cl_usage("--testdata is for --statistics and --histograms");
    if (check_uses(o, of_camera, quality, width) != CL_OK) return CL_USAGE;
    const float narrow = o->camera.fov_min, wide = o->camera.fov_max;
    if ((narrow != 0 || wide != 0) && (narrow < 5 || wide < narrow))
        return cl_usage("--fov-min and --fov-max go together: 5 <= fov-min <= fov-max");
    if ((o->procedural.collected > 0) != (o->collection != NULL))
        return cl_usage("--collection and --collected go together: the folder and the share");
    if (o->sheet && o->collection) return cl_usage("--contact-sheet draws the families, not those of --collection");
    o->procedural.seed = (uint64_t)seed;
    return CL_OK;
}
