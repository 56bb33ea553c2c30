#include "eval/command.h"
#include "cli/arguments.h"
#include "cli/camera.h"
#include "cli/cli.h"
#include "eval/launcher.h"
#include "eval/methods/method.h"
#include "eval/metrics/lpips.h"
#include "eval/set_ini.h"
#include "infer/lgd.h"
#include <stdlib.h>
#include <string.h>

enum {
    IMAGES = 256,
    NOISE,
    SIZE,
    SEED,
    FAST,
    NORMAL,
    WORKFLOW,
    COLOUR,
    METHOD,
    REPEAT,
    PIN,
    LPIPS,
    EXACT,
    TUNE,
    FIGURE,
    PARETO,
    EXPOSURE,
    LIGHT,
    FOV,
    TILT,
    TOLD,
    UNTOLD,
    PEER_MAPS,
    CAMERA,
    SHARD
};

static const cl_argument arguments[] = {
    {'o', "output", "DIR", "write results.csv, summary.csv, times.csv, results.json and report.html there (required)"},
    {'d', "set", "KIND:WHERE",
     "materials to evaluate (required, may be repeated):\nprocedural:SEED,COUNT[,FAMILY...]  generated materials, of "
     "classic, the first seventeen families (the\n"
     "default), of all, or of those that lgd-data --help names\n"
     "strips:FOLDER  images of five panels: input, normal, diffuse, roughness, specular\nmaps:FOLDER  a folder of map "
     "folders\nmultiview:FOLDER  a capture, or a folder of them: 00.png, 01.png ..., camera_pos.txt,\nlight_pos.txt, "
     "image_size.txt, light_power.txt; the input is the picture nearest to the sample's axis\n"
     "photos:FOLDER  photographs without known maps: what the flash leaves in theirs is measured\n"
     "peers:FOLDER  images of nine panels: input, normal, diffuse, roughness, specular, then a peer's four maps\n"
     "sheets:FOLDER  what lgd-data --format sheet-captures wrote: lights and cameras are found in the photographs as\n"
     "lgd-infer --sheet finds them\n"
     "sheets-exact:FOLDER  the same materials from the windows without faults and the true lights and cameras"},
    {TOLD, "told", NULL, "captures, and with --camera: the methods know light and camera (default: they know neither)"},
    {UNTOLD, "untold", NULL,
     "generated materials, strips, map folders and sheets: the methods do not know the light's power; renderings are\n"
     "compared after fitting one factor to the estimate's"},
    {PEER_MAPS, "peer-maps", "FOLDER",
     "photos: a peer's maps of some of them, images of four panels: normal, diffuse, roughness, specular"},
    {NORMAL, "normal", "opengl|directx",
     "y of map folders' normals: opengl or directx (default: from set.ini, meta.txt or the file name)"},
    {WORKFLOW, "workflow", "metallic|specular",
     "workflow of map folders: metallic or specular (default: from set.ini, meta.txt or the files)"},
    {COLOUR, "colour", "srgb|linear",
     "encoding of map folders' colours: srgb or linear (default: from set.ini or meta.txt, else sRGB)"},
    {METHOD, "method", "NAME[:KEY=VALUE,...]",
     "a method to compare (may be repeated; default: lgd, every step); their keys are listed below"},
    {'i', "iterations", "N", "refinement steps, 0 .. 1000 (default: as in lgd-infer)"},
    {'m', "model", "FILE",
     "weights: a file, or the name of a shipped model, phone or single (default: $LGD_MODEL, else phone)"},
    {SIZE, "size", "N", "side of the photographs and maps in pixels, 1 .. 4096 (default 256)"},
    {SEED, "seed", "N", "seed of the renderings' lights and cameras and of the noise (default 1)"},
    {NOISE, "noise", "X", "sensor noise of the input picture, 0 = none .. 1 = a phone at night (default 0)"},
    {EXPOSURE, "exposure", "S",
     "the photographs' light is S times the power that the methods assume, 0.01 .. 100; renderings are then\n"
     "compared after fitting one factor to the estimate's (default 1, without a fit)"},
    {CAMERA, "camera", "phone|KEY=VALUE,...",
     "generated materials, strips and map folders are photographed by a camera with faults, drawn from --seed:\n"
     "phone, or the ranges that lgd-data --help names; the methods do not know light and camera, unless --told"},
    {FOV, "fov", "DEG",
     "the photographs' field of view, 1 .. 170 degrees across their side; the methods know it unless they say\n"
     "view=unknown; not of captures and photographs, which have theirs (default 54.2)"},
    {TILT, "tilt", "DEG",
     "camera and flash are DEG off the normal, 0 .. 60, on the side of the photographs' lower edge; the photographs\n"
     "are rectified, as by lgd-infer --corners; known to the methods as --fov is (default 0)"},
    {LIGHT, "light", "X,Y",
     "position of the flash, X, Y patch widths from the centre, -4 .. 4 each, known to the methods (default 0,0)"},
    {IMAGES, "images", NULL,
     "also write DIR/images/SET-MATERIAL.png: truth, first and last estimate in three rows; one file for each method"},
    {LPIPS, "lpips-weights", "TRUNK LINEAR",
     "also measure LPIPS 0.1, with two files of weights (.pth or safetensors): torchvision's AlexNet and the lpips\n"
     "package's linear heads"},
    {FAST, "fast", NULL, "leave out SSIM and FLIP, which take most of the time"},
    {REPEAT, "repeat", "N", "estimate each photograph N times, 1 .. 1000, and report the median time (default 1)"},
    {PIN, "pin", NULL, "bind every thread to a CPU of its own"},
    {EXACT, "exact", NULL,
     "compute convolutions directly, as lgd-infer --exact; default: Winograd's algorithm where it is faster"},
    {FIGURE, "figure", "NAME",
     "also write DIR/NAME.svg and .csv: iterations (error over T, by default 0 .. 24) or methods (error over time)"},
    {PARETO, "pareto", NULL,
     "write only DIR/pareto.svg and .csv: lgd's time against error at 128, 256, 512 pixels, for T = 0 .. 24, f32 and\n"
     "bf16, and tolerances"},
    {TUNE, "tune", NULL,
     "write only DIR/tune.csv: search the methods' settings (default: of mean, lgd, descent, newton and finetune, "
     "which\n"
     "need no weights of their own)"},
    {SHARD, "shard", "I/N",
     "do part I of N of the materials, 1 .. N; the call with the same DIR that ends last writes the results of all, "
     "as\n"
     "one call would. Under mpirun every process does its part by itself"},
    {'t', "threads", "N", "number of threads, 1 .. 1024; 0 = all that are allowed (default 0)"},
    {'q', "quiet", NULL, "print no progress"},
    {'h', "help", NULL, "print this help"},
    {'V', "version", NULL, "print the version"},
    {0, NULL, NULL, NULL}};

static ts_code whole(const char *name, const char *text, int64_t lo, int64_t hi, int64_t *value, ts_status *st)
{
    if (cl_parse_int(text, lo, hi, value)) return TS_OK;
    return ts_fail(st, TS_INVALID, "--%s: '%s' is not a whole number in %lld .. %lld", name, text, (long long)lo,
                   (long long)hi);
}

static ts_code parse_light(const char *text, double light[2], ts_status *st)
{
    char x[32];
    const char *comma = strchr(text, ',');
    const size_t n = comma ? (size_t)(comma - text) : 0;
    if (n > 0 && n < sizeof x) {
        memcpy(x, text, n);
        x[n] = 0;
        if (cl_parse_real(x, -4, 4, &light[0]) && cl_parse_real(comma + 1, -4, 4, &light[1])) return TS_OK;
    }
    return ts_fail(st, TS_INVALID, "--light: '%s' is not X,Y with numbers in -4 .. 4", text);
}

ts_code ev_command_parse(int argc, char **argv, ev_command *c, ts_status *st)
{
    *c = (ev_command){.iterations = -1, .seed = 1, .repeat = 1};
    const char *value = NULL;
    int key, operands = argc;
    int64_t n = 0;
    ts_code code = TS_OK;
    while (!code && !c->help && !c->version &&
           (key = cl_argument_next(argc, argv, arguments, &value, &operands, st)) != CL_ARGUMENT_END) {
        switch (key) {
        case 'o': c->out = value; break;
        case 'm': c->model = value; break;
        case 'q': c->quiet = true; break;
        case 'h': c->help = true; break;
        case 'V': c->version = true; break;
        case PIN: c->pin = true; break;
        case EXACT: c->exact = true; break;
        case TUNE: c->tune = true; break;
        case PARETO: c->pareto = true; break;
        case FIGURE:
            if (!strcmp(value, "iterations")) c->iterations_figure = true;
            else if (!strcmp(value, "methods")) c->methods_figure = true;
            else code = ts_fail(st, TS_INVALID, "--figure: '%s' is neither 'iterations' nor 'methods'", value);
            break;
        case METHOD:
            if (c->methods == EV_METHODS_MAX)
                code = ts_fail(st, TS_INVALID, "--method: more than %d methods", EV_METHODS_MAX);
            else c->method[c->methods++] = value;
            break;
        case REPEAT:
            code = whole("repeat", value, 1, 1000, &n, st);
            c->repeat = (int)n;
            break;
        case EXPOSURE:
            if (!cl_parse_real(value, 0.01, 100, &c->exposure))
                code = ts_fail(st, TS_INVALID, "--exposure: '%s' is not a number in 0.01 .. 100", value);
            break;
        case FOV:
            if (!cl_parse_real(value, LGD_FOV_LEAST, LGD_FOV_MOST, &c->fov))
                code = ts_fail(st, TS_INVALID, "--fov: '%s' is not an angle in %g .. %g degrees", value, LGD_FOV_LEAST,
                               LGD_FOV_MOST);
            break;
        case TILT:
            if (!cl_parse_real(value, 0, 60, &c->tilt))
                code = ts_fail(st, TS_INVALID, "--tilt: '%s' is not an angle in 0 .. 60 degrees", value);
            break;
        case LIGHT: code = parse_light(value, c->light, st); break;
        case CAMERA:
            c->photographed = true;
            c->camera_spec = value;
            code = cl_camera_parse(value, &c->camera, st);
            break;
        case SHARD:
            if (!cl_parse_shard(value, &c->shard, &c->shards))
                code = ts_fail(st, TS_INVALID, "--shard: '%s' is not I/N with I in 1 .. N", value);
            break;
        case TOLD: c->light_known = true; break;
        case UNTOLD: c->light_unknown = true; break;
        case PEER_MAPS: c->peer_maps = value; break;
        case IMAGES: c->images = true; break;
        case FAST: c->fast = true; break;
        case LPIPS:
            c->lpips[0] = value;
            if (!(c->lpips[1] = cl_argument_second(argc, argv)))
                code = ts_fail(st, TS_INVALID, "--lpips-weights needs two files: TRUNK LINEAR");
            break;
        case SEED: code = whole("seed", value, 0, INT64_MAX, &c->seed, st); break;
        case 'd':
            if (c->sets == EV_SETS_MAX) code = ts_fail(st, TS_INVALID, "--set: more than %d sets", EV_SETS_MAX);
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
            if (!ev_set_ini_key("normal", value, &c->convention))
                code = ts_fail(st, TS_INVALID, "--normal: '%s' is neither 'opengl' nor 'directx'", value);
            break;
        case WORKFLOW:
            if (!ev_set_ini_key("workflow", value, &c->convention))
                code = ts_fail(st, TS_INVALID, "--workflow: '%s' is neither 'metallic' nor 'specular'", value);
            break;
        case COLOUR:
            if (!ev_set_ini_key("colour", value, &c->convention))
                code = ts_fail(st, TS_INVALID, "--colour: '%s' is neither 'srgb' nor 'linear'", value);
            break;
        case NOISE:
            if (!cl_parse_real(value, 0, 1, &c->noise))
                code = ts_fail(st, TS_INVALID, "--noise: '%s' is not a number in 0 .. 1", value);
            break;
        default: code = st->code;
        }
    }
    if (code || c->help || c->version) return code;
    if (operands < argc)
        return ts_fail(st, TS_INVALID, "'%s' is not an option; sets are given as --set KIND:WHERE", argv[operands]);
    if (c->photographed && (c->exposure > 0 || c->noise > 0 || c->light_unknown))
        return ts_fail(st, TS_INVALID, "--camera draws light and noise: give no --exposure, --noise or --untold");
    const bool draws_fov = c->photographed && c->camera.fov_max > 0,
               draws_tilt = c->photographed && (c->camera.tilt > 0 || c->camera.off_centre > 0);
    if ((c->tilt > 0 && (draws_tilt || draws_fov)) || (c->fov > 0 && draws_fov))
        return ts_fail(st, TS_INVALID, "--camera draws where the photographs are taken from: give no --%s",
                       c->tilt > 0 ? "tilt" : "fov");
    if (c->sets == 0) return ts_fail(st, TS_INVALID, "no set is given: --set KIND:WHERE");
    if (c->tune + c->pareto + (c->iterations_figure || c->methods_figure) > 1)
        return ts_fail(st, TS_INVALID, "--tune, --pareto and --figure are different tasks: choose one");
    if (c->pareto && (c->methods || c->iterations >= 0))
        return ts_fail(st, TS_INVALID,
                       "--pareto has its own methods and iterations: --method and --iterations do not go with it");
    if (!c->shards) ev_shard_of_launcher(&c->shard, &c->shards);
    if (c->pareto && c->shards)
        return ts_fail(st, TS_INVALID, "--pareto measures times: it is one process's work, without --shard or mpirun");
    if (c->tune && c->iterations >= 0)
        return ts_fail(st, TS_INVALID, "--tune: --iterations does not go with it: give each method iterations=");
    if (c->pareto && c->size) return ts_fail(st, TS_INVALID, "--pareto has its own sizes: --size does not go with it");
    if ((c->tune || c->pareto) && c->lpips[0])
        return ts_fail(st, TS_INVALID, "--lpips-weights does not go with --tune or --pareto, which write no LPIPS");
    if (!c->size) c->size = 256;
    if (c->lpips[0] && c->size < EV_LPIPS_SIDE)
        return ts_fail(st, TS_INVALID, "--lpips-weights needs pictures of at least %d x %d pixels: --size",
                       EV_LPIPS_SIDE, EV_LPIPS_SIDE);
    if ((c->tune || c->pareto) && c->images)
        return ts_fail(st, TS_INVALID, "--images does not go with --tune or --pareto");
    if (!c->out || !*c->out) return ts_fail(st, TS_INVALID, "no output folder is given: -o DIR");
    return TS_OK;
}

void ev_command_help(void)
{
    puts("Usage: lgd-eval [options] --set KIND:WHERE... -o DIR\n"
         "Renders each known material under a flash (of a capture: takes one picture) and estimates its maps "
         "from\n"
         "that photograph. Prints, for R_0 and after every refinement step, or for each method:\n"
         "  the RMSE of the maps (diffuse and specular in gamma space, roughness and normal linear), the RMSE of\n"
         "  renderings under other lights and cameras, the mean angle between the normals in degrees,\n"
         "  and SSIM, FLIP (and LPIPS) of the renderings, for R_0 and the last step.\n"
         "The same seed gives the same numbers for any number of threads.\n");
    cl_argument_help(arguments, stdout);
    puts("\nMethods (values contain no commas; every method also has label=TEXT):");
    ev_method_help(stdout);
    puts("\nExit status: 0 done, 1 a material failed (the others are in the results) or nothing could be written, 2 "
         "wrong usage, 130\ninterrupted.");
}
