#include "cli/infer/options.h"
#include "cli/cli.h"
#include "data/image/image.h"
#include "data/seamless.h"
#include "infer/order.h"
#include <string.h>

enum {
    NORMAL = 256,
    CAPTURE,
    POWER,
    FOV,
    CORNERS,
    SHEET,
    MAPS,
    AO,
    SEAMLESS,
    EXR,
    WORKFLOW,
    MASK,
    TOLERANCE,
    ORIENTATIONS,
    SAMPLE,
    EXACT,
    PRECISION,
    MAX_PIXELS,
    MAX_MEMORY,
    SKIP_EXISTING,
    SHARD,
    HELP = 'h',
    VERSION = 'V'
};

const cl_argument cl_infer_arguments[] = {
    {'o', "output", "DIR",
     "output folder (required); each photograph gets DIR/STEM/, STEM = its file name without extension, of\n"
     "a capture's folder its whole name, of a file capture.ini the name of the folder that it lies in"},
    {'s', "size", "N", "side of the maps in pixels, 1 .. 8192 (default 256)"},
    {'i', "iterations", "N|auto",
     "refinement steps, 0 .. 1000; 0 = the first estimate only; auto = as long as the reconstruction improves,\n"
     "24 at most (default: as trained; of several photographs phone makes twice as many)"},
    {ORIENTATIONS, "orientations", "N",
     "the first estimate is the mean over N orientations of the photograph: 1 (as it is), 2 (and a quarter turn), 4\n"
     "(all quarter turns), 8 (and their mirror images) or auto (the default: 1 where the model guesses the camera\n"
     "or the light's power, else 2)"},
    {SAMPLE, "sample", "metal|dielectric|auto",
     "what the sample is, all of it: bare metal, or none (wood, stone, cloth, leather, plastic, paint); one "
     "photograph\n"
     "often leaves it open (default auto: the model decides). Not with single"},
    {EXACT, "exact", NULL,
     "compute convolutions directly; the default is Winograd's algorithm where it is faster: the maps differ by less\n"
     "than 1e-5 (RMS), single values by less than 1e-3"},
    {PRECISION, "precision", "f32|bf16",
     "precision of the products in convolutions (default f32); bf16 is faster on CPUs with AMX or AMD's AVX512-BF16,\n"
     "slower on others; the maps differ by less than 0.005 (RMS; with --fov the roughness of a few by up to 0.05),\n"
     "single values by up to 0.8"},
    {CAPTURE, "capture", "WHERE",
     "instead of PHOTO: 1 to 100 photographs of one sample under known lights, listed in an INI file or in a folder\n"
     "in MaterialGAN's layout; the first nine are used"},
    {FOV, "fov", "DEG",
     "field of view of the photographs, 1 .. 170 degrees across the side of the square that the maps cover\n"
     "(default: from the file's EXIF, else the model's guess, or 54.2 with a warning)"},
    {CORNERS, "corners", "X,Y X,Y X,Y X,Y",
     "the photograph was taken at an angle: where the corners of a square on the sample are in it, top left, top\n"
     "right, bottom right, bottom left, in pixels from the top left or in 0 .. 1 of width and height; the maps are of\n"
     "that square, and --fov is across the photograph's shorter side"},
    {SHEET, "sheet", NULL,
     "the photographs are of one sample in the window of lgd-capture's printed sheet: DIR/STEM/ of the first gets the\n"
     "maps of all; cameras, flash and exposure are found from the sheet; --fov is across the photographs' shorter\n"
     "side"},
    {POWER, "light-power", "P",
     "power of the light, relative to the default light (of a capture: to the power it states): a number in\n"
     "0.01 .. 100, or auto = estimated from the photograph and printed, of a capture from each (default auto; of a\n"
     "sheet 1)"},
    {MASK, "mask", "FILE",
     "an image of the photographs' shape, upright as they are: refine only where it is neither black nor transparent;\n"
     "there the maps are the same as without it, elsewhere they may be those of an earlier step"},
    {TOLERANCE, "tolerance", "X",
     "early stop, 0 .. 1: a tile is done when one step changes its maps by less than X (RMS, maps in -1 .. 1);\n"
     "photographs up to 512 pixels are one tile; 0 = never (default: 0.003 for models whose network works at the\n"
     "photograph's size, not with --iterations or --exact; 0 for others, such as the shipped ones)"},
    {'m', "model", "FILE",
     "weights: a file, or the name of a shipped model: phone, or single for pictures whose light and camera are the\n"
     "default ones (default: $LGD_MODEL, else phone)"},
    {'t', "threads", "N", "number of threads, 1 .. 1024; 0 = all that are allowed (default 0)"},
    {NORMAL, "normal", "gl|dx",
     "y of the normals in normal.png and maps.exr: up (gl, OpenGL, default) or down (dx, DirectX)"},
    {MAPS, "maps", "LIST",
     "files to write, separated by commas: diffuse, specular, roughness, normal, exr, render, preview (default: all\n"
     "of these), basecolor, metallic, height, ao (ambient occlusion), orm (occlusion, roughness and metalness in "
     "one),\n"
     "gltf, glb (glTF as one file), materialx, page (view.html lights the material in a browser; of several\n"
     "photographs, not with --shard, index.html too); gltf and materialx come with the maps that they refer to; files\n"
     "of another estimate that DIR/STEM/meta.txt names are removed"},
    {AO, "ao", NULL, "also write occlusion.png: ambient occlusion of the height; gltf and glb then have it too"},
    {SEAMLESS, "seamless", NULL,
     "all maps repeat without a visible border: the same seam is cut through all of them; 7/8 of the square remain"},
    {EXR, "exr", "half|float",
     "numbers of maps.exr: half floats, compressed, or floats (default: float up to 512 pixels, half above)"},
    {WORKFLOW, "workflow", "specular|metallic",
     "specular (default), or metallic: base colour and metalness instead of diffuse and specular; the error of the\n"
     "conversion is printed"},
    {MAX_PIXELS, "max-pixels", "N", "refuse photographs with more pixels (default 268435456)"},
    {MAX_MEMORY, "max-memory", "SIZE",
     "refuse what needs more memory at once: a number of bytes, or with K, M or G behind it (default: three\n"
     "quarters of what the machine has or its control group allows)"},
    {SKIP_EXISTING, "skip-existing", NULL,
     "leave out photographs whose DIR/STEM/ is complete and made from the same bytes by the same weights and options"},
    {SHARD, "shard", "I/N",
     "do part I of N of the photographs, 1 .. N; the name STEM decides which part, so that any number of calls with\n"
     "the same DIR share the work"},
    {'q', "quiet", NULL, "print errors only"},
    {HELP, "help", NULL, "print this help"},
    {VERSION, "version", NULL, "print the version"},
    {0, NULL, NULL, NULL}};

/* Where the normals' y is to be seen, and what the two workflows have different or one of them alone. */
enum {
    WITH_NORMALS = LGD_OUT_NORMAL | LGD_OUT_EXR | LGD_OUT_GLB,
    OF_A_WORKFLOW = LGD_OUT_DIFFUSE | LGD_OUT_SPECULAR | LGD_OUT_BASECOLOR | LGD_OUT_METALLIC | LGD_OUT_ORM |
        LGD_OUT_GLTF | LGD_OUT_GLB | LGD_OUT_MATERIALX
};

static ts_code whole(const char *name, const char *text, int64_t lo, int64_t hi, int64_t *value, ts_status *st)
{
    if (cl_parse_int(text, lo, hi, value)) return TS_OK;
    return ts_fail(st, TS_INVALID, "--%s: '%s' is not a whole number in %lld .. %lld", name, text, (long long)lo,
                   (long long)hi);
}

static ts_code take_corners(int argc, char **argv, const char *value, cl_command *c, ts_status *st)
{
    const char *words[4] = {value};
    int count = 1;
    while (!strchr(value, ' ') && count < 4 && (words[count] = cl_argument_second(argc, argv))) count++;
    c->corners = true;
    if (io_corners_parse(words, count, &c->angle, st) != TS_OK) ts_context(st, "--corners");
    return st->code;
}

static ts_code take_capture(const char *value, cl_command *c, ts_status *st)
{
    size_t n = strlen(value);
    while (n > 1 && value[n - 1] == '/') n--;
    if (cl_check_name("--capture", value, st) != TS_OK) return st->code;
    if (n >= sizeof c->capture) return ts_fail(st, TS_INVALID, "--capture: the name is too long");
    memcpy(c->capture, value, n);
    c->capture[n] = 0;
    return TS_OK;
}

ts_code cl_command_parse(int argc, char **argv, cl_command *c, ts_status *st)
{
    *c = (cl_command){.size = 256,
                      .iterations = -1,
                      .orientations = LGD_ORIENTATIONS_DEFAULT,
                      .tolerance = LGD_TOLERANCE_DEFAULT,
                      .max_pixels = IO_MAX_PIXELS_DEFAULT};
    const char *value = NULL;
    int key, operands = argc;
    int64_t n = 0;
    ts_code code = TS_OK;
    bool power_given = false, exr_given = false, normal_given = false, workflow_given = false, ao = false;
    while (!code && !c->help && !c->version &&
           (key = cl_argument_next(argc, argv, cl_infer_arguments, &value, &operands, st)) != CL_ARGUMENT_END) {
        switch (key) {
        case 'o':
            c->out = value;
            code = cl_check_name("-o", value, st);
            break;
        case 'm':
            c->model = value;
            code = cl_check_name("--model", value, st);
            break;
        case 'q': c->quiet = true; break;
        case HELP: c->help = true; break;
        case VERSION: c->version = true; break;
        case MAX_PIXELS: code = whole("max-pixels", value, 1, INT64_C(1) << 40, &c->max_pixels, st); break;
        case MAX_MEMORY:
            if (!cl_parse_size(value, &c->max_memory))
                code = ts_fail(st, TS_INVALID, "--max-memory: '%s' is not a size such as 4G, 500M or 2000000000",
                               value);
            break;
        case 's':
            code = whole("size", value, 1, 8192, &n, st);
            c->size = (int)n;
            break;
        case 'i':
            if (strcmp(value, "auto") == 0) n = LGD_AUTO;
            else code = whole("iterations", value, 0, 1000, &n, st);
            c->iterations = (int)n;
            break;
        case 't':
            code = whole("threads", value, 0, 1024, &n, st);
            c->threads = (int)n;
            break;
        case ORIENTATIONS:
            if (!strcmp(value, "auto")) c->orientations = LGD_ORIENTATIONS_DEFAULT;
            else if (strlen(value) == 1 && strchr("1248", *value)) c->orientations = *value - '0';
            else code = ts_fail(st, TS_INVALID, "--orientations: '%s' is not 1, 2, 4, 8 or auto", value);
            break;
        case SAMPLE:
            c->sample = !strcmp(value, "metal") ? LGD_SAMPLE_METAL
                : !strcmp(value, "dielectric")  ? LGD_SAMPLE_DIELECTRIC
                                                : LGD_SAMPLE_UNKNOWN;
            if (c->sample == LGD_SAMPLE_UNKNOWN && strcmp(value, "auto") != 0)
                code = ts_fail(st, TS_INVALID, "--sample: '%s' is not metal, dielectric or auto", value);
            break;
        case EXACT: c->exact = true; break;
        case SKIP_EXISTING: c->skip_existing = true; break;
        case SHARD:
            if (!cl_parse_shard(value, &c->shard, &c->shards))
                code = ts_fail(st, TS_INVALID, "--shard: '%s' is not I/N with I in 1 .. N", value);
            break;
        case PRECISION:
            c->bf16 = strcmp(value, "bf16") == 0;
            if (!c->bf16 && strcmp(value, "f32") != 0)
                code = ts_fail(st, TS_INVALID, "--precision: '%s' is neither f32 nor bf16", value);
            break;
        case FOV:
            if (!cl_parse_real(value, LGD_FOV_LEAST, LGD_FOV_MOST, &c->fov))
                code = ts_fail(st, TS_INVALID, "--fov: '%s' is not an angle in %g .. %g degrees", value, LGD_FOV_LEAST,
                               LGD_FOV_MOST);
            break;
        case CORNERS: code = take_corners(argc, argv, value, c, st); break;
        case SHEET: c->sheet = true; break;
        case POWER:
            power_given = true;
            c->power = 0;
            if (strcmp(value, "auto") != 0 && !cl_parse_real(value, 0.01, 100, &c->power))
                code = ts_fail(st, TS_INVALID, "--light-power: '%s' is neither auto nor a number in 0.01 .. 100",
                               value);
            break;
        case MASK:
            c->mask = value;
            code = cl_check_name("--mask", value, st);
            break;
        case CAPTURE: code = take_capture(value, c, st); break;
        case TOLERANCE:
            if (!cl_parse_real(value, 0, 1, &c->tolerance))
                code = ts_fail(st, TS_INVALID, "--tolerance: '%s' is not a number in 0 .. 1", value);
            break;
        case MAPS:
            code = lgd_output_parse(value, &c->outputs, st);
            if (code) ts_context(st, "--maps");
            break;
        case AO: ao = true; break;
        case SEAMLESS: c->seamless = true; break;
        case EXR:
            exr_given = true;
            c->half = strcmp(value, "half") == 0;
            if (!c->half && strcmp(value, "float") != 0)
                code = ts_fail(st, TS_INVALID, "--exr: '%s' is neither half nor float", value);
            break;
        case WORKFLOW:
            workflow_given = true;
            c->metallic = strcmp(value, "metallic") == 0;
            if (!c->metallic && strcmp(value, "specular") != 0)
                code = ts_fail(st, TS_INVALID, "--workflow: '%s' is neither specular nor metallic", value);
            break;
        case NORMAL:
            normal_given = true;
            c->directx = strcmp(value, "dx") == 0;
            if (!c->directx && strcmp(value, "gl") != 0)
                code = ts_fail(st, TS_INVALID, "--normal: '%s' is neither gl nor dx", value);
            break;
        default: code = st->code;
        }
    }
    if (code || c->help || c->version) return code;
    const lgd_order order = {.which = c->outputs, .directx = c->directx, .metallic = c->metallic};
    if (lgd_order_check(&order, st) != TS_OK) return ts_context(st, "--maps");
    if (c->seamless && c->size < IO_SEAMLESS_LEAST)
        return ts_fail(st, TS_INVALID, "--seamless needs a --size of %d at least", IO_SEAMLESS_LEAST);
    c->outputs = lgd_output_complete((c->outputs ? c->outputs : LGD_OUT_DEFAULT) | (ao ? LGD_OUT_AO : 0), c->metallic);
    if (exr_given && !(c->outputs & LGD_OUT_EXR))
        return ts_fail(st, TS_INVALID, "--exr is for maps.exr: --maps must list exr");
    if (normal_given && !(c->outputs & WITH_NORMALS))
        return ts_fail(st, TS_INVALID, "--normal is for normal.png and maps.exr: --maps must list normal or exr");
    if (workflow_given && !(c->outputs & OF_A_WORKFLOW))
        return ts_fail(st, TS_INVALID,
                       "--workflow is for colours and documents: --maps must list one of diffuse, specular, basecolor, "
                       "metallic, orm, gltf, glb, materialx");
    if (c->mask && c->iterations == 0)
        return ts_fail(st, TS_INVALID, "--mask says where the maps are refined: not with --iterations 0");
    if (!exr_given) c->half = c->size > LGD_HALF_ABOVE;
    c->photo = argv + operands;
    c->photos = argc - operands;
    if (*c->capture && c->photos > 0)
        return ts_fail(st, TS_INVALID, "--capture lists its photographs: '%s' is one more", c->photo[0]);
    if (*c->capture && c->fov > 0) return ts_fail(st, TS_INVALID, "--capture says where its cameras are: no --fov");
    if (*c->capture && c->corners) return ts_fail(st, TS_INVALID, "--corners is for a photograph: not with --capture");
    if (c->corners && c->mask)
        return ts_fail(st, TS_INVALID, "--mask is for photographs taken straight on: no --corners");
    if (*c->capture && c->mask)
        return ts_fail(st, TS_INVALID, "--mask needs the shape of a photograph: not with --capture");
    if (c->sheet && (*c->capture || c->corners || c->mask))
        return ts_fail(st, TS_INVALID, "--sheet finds the sample and the lights itself: not with --%s",
                       *c->capture      ? "capture"
                           : c->corners ? "corners"
                                        : "mask");
    if ((c->sheet || c->corners) && c->orientations > 1)
        return ts_fail(st, TS_INVALID, "--orientations is for a light above the sample's centre: not with --%s",
                       c->sheet ? "sheet" : "corners");
    if (c->sheet && !power_given) c->power = 1;
    if ((*c->capture || c->sheet) && (c->skip_existing || c->shards))
        return ts_fail(st, TS_INVALID, "--%s is one material: no --%s", c->sheet ? "sheet" : "capture",
                       c->shards ? "shard" : "skip-existing");
    if (*c->capture) {
        c->only[0] = c->capture;
        c->photo = c->only;
        c->photos = 1;
    }
    if (c->photos == 0) return ts_fail(st, TS_INVALID, "no photograph is given");
    if (!c->out) return ts_fail(st, TS_INVALID, "no output folder is given: -o DIR");
    return TS_OK;
}

bool cl_command_one_file(const cl_command *c) { return !*c->capture && !c->sheet; }

int cl_command_steps(const cl_command *c, const lgd_model *model, int photos)
{
    if (c->iterations == LGD_AUTO) return LGD_AUTO_MOST;
    return c->iterations < 0 ? lgd_usual_iterations(model, photos) : c->iterations;
}
