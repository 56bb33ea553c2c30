/* lgd: the material of a flat surface from one flash photograph. The public C API.
 *
 *     lgd_find_weights, lgd_load         a model
 *     lgd_read_photo, or lgd_square      the photograph, from a file or from memory
 *     lgd_estimate                       its maps
 *     lgd_write_maps, or lgd_render      files, or another picture
 *
 * Functions that return int and take an error return 0, or nonzero with it set, and what they fill unspecified; it may
 * be NULL. The small buffers of convolutions (tensor/scratch.h) are the exception: where they cannot be had the process
 * is aborted.
 * Structs that may grow begin with their size where the caller was compiled. Fields beyond it have their defaults.
 * Limits, beyond which a call is refused: side 1 .. 16384, iterations at most 1000, threads at most 1024, tolerance
 * 0 .. 1. */
#ifndef LGD_H
#define LGD_H
#include <stddef.h>

#if defined(__GNUC__)
#define LGD_API __attribute__((visibility("default")))
#else
#define LGD_API
#endif

#ifdef __cplusplus
extern "C" {
#endif

typedef struct lgd_model lgd_model;

/* One line of text about the last failure of that call; empty after success. */
typedef struct lgd_error {
    int code; /* 0: none */
    char message[512];
} lgd_error;

/* Reads a weights file (safetensors or PyTorch). NULL and error on failure. The file stays mapped: it may be replaced
 * or removed meanwhile, but not be written over in place. The caller frees the model, when no call uses it. Any number
 * of threads may call lgd_estimate with one model at once. Each such call has memory of its own (up to 47 MB at 256 x
 * 256 pixels), which the model keeps for later calls up to 512 pixels a side. */
LGD_API lgd_model *lgd_load(const char *weights, lgd_error *error);
LGD_API void lgd_free(lgd_model **model);

LGD_API int lgd_trained_iterations(const lgd_model *model); /* the number of steps T that the model was trained for */
/* What iterations = -1 stands for with so many photographs of one sample: T, and 2 T where the steps go to the most
 * probable maps by several photographs. */
LGD_API int lgd_usual_iterations(const lgd_model *model, int photos);
/* Photographs of one sample that it takes at once: 1, those of a multi-image model, or 9 of one whose steps go to the
 * most probable maps. */
LGD_API int lgd_most_photos(const lgd_model *model);
LGD_API int lgd_published(const lgd_model *model); /* nonzero: the published network's weights (docs/published.md) */

/* The file of the weights that a program reads with --model name: a file, or the name of a model that ships with lgd;
 * NULL: $LGD_MODEL, else "phone". path: size bytes, 4096 at best. */
LGD_API int lgd_find_weights(const char *name, char *path, size_t size, lgd_error *error);

/* LGD_AUTO: steps go on while each lowers the reconstruction RMSE by a thousandth or more, LGD_AUTO_MOST at most. The
 * result is R_t of the last such step. The first steps of several photographs whose lights and cameras are known may be
 * revisions (docs/math.md): these are always made. The steps of photographs in several tiles, and of those with mask or
 * tolerance, are counted on the photograph at 256 x 256 pixels. */
enum { LGD_AUTO = -2, LGD_AUTO_MOST = 24 };

/* The tolerance of least time whose renderings are at most 1% worse than those of all steps (docs/accuracy.md). */
#define LGD_TOLERANCE 0.003
#define LGD_TOLERANCE_DEFAULT (-1.0)
/* As suits what is known: 1 where the model guesses the camera or the light's power, else 2 (docs/accuracy.md). */
#define LGD_ORIENTATIONS_DEFAULT 0

enum { LGD_F32, LGD_BF16 };

/* The angle in degrees across the side of the square that the image is; 2 atan(1/2 / d), d the camera's height in patch
 * widths. */
#define LGD_FOV_DEFAULT 54.2249 /* that of lgd_flash_photo */
#define LGD_FOV_UNKNOWN 0.0
#define LGD_FOV_OF_PHOTO (-1.0) /* the places in lgd_photo are true */
#define LGD_FOV_LEAST 1.0
#define LGD_FOV_MOST 170.0

enum { LGD_SAMPLE_UNKNOWN, LGD_SAMPLE_DIELECTRIC, LGD_SAMPLE_METAL };

typedef struct lgd_photo lgd_photo;

/* New fields are added at the end. Begin with lgd_options_default(). */
typedef struct lgd_options {
    size_t size;      /* sizeof(lgd_options) where the caller was compiled: fields beyond it have their defaults */
    int iterations;   /* refinement steps; 0: R_0 alone, -1: lgd_usual_iterations, LGD_AUTO */
    int exact;        /* 0: convolutions use Winograd's algorithm where it is faster; else all are computed directly.
                       * In f32 g of the published network always is, but for its last block. The shipped model's maps
                       * of real photographs differ by less than 1e-5 (RMS of a map), single values by less than 1e-3,
                       * as they do between instruction sets (docs/accuracy.md) */
    int precision;    /* LGD_F32; LGD_BF16: inputs and weights of convolutions are rounded to bf16, for CPUs with AMX or
                       * AVX512-BF16 (much slower on others). Sums, renderer and maps stay f32. Maps differ by
                       * less than 0.005 (RMS), fewer than one value in 10,000 by more than 0.05, single ones by up to
                       * 0.8; in a field of view that is given the roughness by less than 0.05, where a photograph
                       * leaves its level open (docs/accuracy.md) */
    int orientations; /* R_0 is the mean over so many orientations of the photograph: 1: as it is, 2: and turned by a
                       * quarter, 4: all quarter turns, 8: and their mirror images; 0: LGD_ORIENTATIONS_DEFAULT. Only
                       * of a photograph with light and camera above its centre, and not with published weights; of
                       * several only with models that guess the scene, the one that they read first */
    int threads;      /* that the call computes on; 0: as many as the process may use */
    /* Called after R_0 (step 0) and after every step; return nonzero to stop there. May be NULL. rmse: the
     * reconstruction RMSE after R_0 and after the last step. Between them it is NAN, unless iterations is LGD_AUTO or
     * every_rmse is not 0, which takes a tenth more time. */
    int (*progress)(int step, double rmse, void *user);
    void *user;
    int every_rmse;
    /* side x side, or NULL. Where it is not 0 the maps are refined, exactly as without a mask; elsewhere they may be
     * those of an earlier step, which saves time. */
    const unsigned char *mask;
    /* Early stop: a tile is done when one step changes its maps by less than this (RMS over the tile and its halo, maps
     * in [-1, 1]). Tiles are 256 px, 128 px with a mask; a photograph up to 512 px without a mask is one tile. 0 =
     * never. LGD_TOLERANCE_DEFAULT = LGD_TOLERANCE if the model has a full-size h and iterations == -1 and !exact, else
     * 0. */
    double tolerance;
    /* Called before each tile of a photograph in several tiles (over 512 px, or with a mask), with the fraction that is
     * done; nonzero ends the work with an error. May be NULL. progress is then called for every step at the end, since
     * a tile makes all its steps at once; stopping at a step does the work again up to there. */
    int (*tile)(double done, void *user);
    /* NULL: the lights' powers are those of the photographs. Else the factor that fits them all is estimated from the
     * photographs, used, and written here. A stronger light and a brighter albedo look alike, so only what the model's
     * materials cannot explain, such as an albedo above 1, counts. 1 for published weights, whose light is fixed. Of a
     * model that guesses how far away the camera is, the factor on what reaches the sample; there the others of
     * several photographs have exposures of their own. */
    double *power;
    /* The photograph's field of view, LGD_FOV_LEAST .. LGD_FOV_MOST degrees, of one photograph alone: camera and light
     * are moved to that height, and the power grows so that the sample is as bright. LGD_FOV_UNKNOWN (the default):
     * they are where the photograph says, and models that guess the scene estimate the places of both.
     * LGD_FOV_OF_PHOTO: they are where it says, and those models know it; so it is of several photographs. */
    double fov;
    /* NULL, or room for as many photographs as are given: each with light, camera and power as they were taken. May be
     * the given ones. */
    lgd_photo *taken;
    /* What the sample is known to be, all of it: LGD_SAMPLE_UNKNOWN (the default), LGD_SAMPLE_DIELECTRIC (wood, stone,
     * cloth, leather, plastic, paint; F0 near .04) or LGD_SAMPLE_METAL (bare metal: next to no diffuse). One photograph
     * often leaves it open. Only of models that guess the scene. */
    int sample;
    /* NULL, or where the ambient light in the first photograph goes that models which guess the scene find with it: the
     * radiance A of uniform surroundings, A (F0 + (1 - F0) diffuse) more in its rendering, which lgd_render leaves out.
     * Of several photographs it is found in the one that they read first, the flash straight above: of another that
     * is given first it is 0, as of other models. */
    double *ambient;
} lgd_options;
/* Fills size bytes with the defaults, whichever version the library has. */
LGD_API void lgd_options_init(lgd_options *options, size_t size);
static inline lgd_options lgd_options_default(void)
{
    lgd_options options;
    lgd_options_init(&options, sizeof options);
    return options;
}

/* image: side x side x 3 linear values (clamped to [0, 1] here, black where not finite), top row first. maps: side x
 * side x 9, in [0, 1] where not said otherwise: diffuse rgb, normal x and y in [-1, 1] (OpenGL, z = sqrt(1 - x^2 -
 * y^2)), roughness, specular F0 rgb. Returns 0, or nonzero with error set and maps unspecified. */
LGD_API int lgd_estimate(lgd_model *model, const float *image, int side, const lgd_options *options, float *maps,
                         lgd_error *error);

/* A photograph of the sample, rectified to it. Positions in patch widths (the sample is [-1/2, 1/2]^2 at z = 0, x
 * right, y up), both above the sample; radiance = BRDF max(n.l, 0) power / distance^2. */
struct lgd_photo {
    const float *image; /* as lgd_estimate's */
    float light[3], camera[3], power;
};

/* The photograph that lgd_estimate assumes: light and camera at one place above the centre, of the default power. */
LGD_API lgd_photo lgd_flash_photo(const float *image);

/* lgd_estimate from 1 .. lgd_most_photos photographs under known lights, in any order. */
LGD_API int lgd_estimate_photos(lgd_model *model, const lgd_photo *photo, int photos, int side,
                                const lgd_options *options, float *maps, lgd_error *error);

/* Renders maps as returned by lgd_estimate under a point light and a camera (positions in patch widths, the sample is
 * [-1/2, 1/2]^2 at z = 0, y up): image is side x side x 3, linear. */
LGD_API int lgd_render(const float *maps, int side, const float light[3], const float camera[3], float power,
                       float *image, lgd_error *error);

/* All zero but size is the default. */
typedef struct lgd_read_options {
    size_t size;          /* sizeof(lgd_read_options) */
    int published;        /* lgd_published() of the model that the photograph is for: it is resampled as the network's
                           * authors do */
    long long max_pixels; /* files with more are refused; 0: 2^28 */
    int threads;          /* that the call computes on; 0: as many as the process may use */
} lgd_read_options;

/* What is known of a photograph beside its pixels. */
typedef struct lgd_facts {
    size_t size;       /* sizeof(lgd_facts), set by the caller; lgd_read_photo fills the others, with zeros what it does
                        * not know */
    int width, height; /* of the whole photograph, upright */
    double fov; /* degrees across its largest centred square, from EXIF: for lgd_options.fov; or LGD_FOV_UNKNOWN */
    char fov_from[128]; /* where fov is known from, or why it is not: for lgd_write_options, with fov_unknown */
    char profile[96];   /* the name of a colour profile that cannot be used: sRGB was assumed; or empty */
    int transparent;    /* 1: somewhere, where it is taken as black */
} lgd_facts;

/* A photograph's largest centred square as side x side x 3 linear values (sRGB primaries; above 1 only from files that
 * say so), top row first. Upright by its EXIF orientation; colour profiles are honoured, alpha lies on black (neither
 * with options.published). Ordinary PNG and JPEG files are read by this library; other formats, palettes, CMYK and
 * files with IPTC or an orientation in XMP by OpenImageIO in lgd/liblgd_image.so beside it. A process that is forked
 * after that was loaded may read on, but ends by _exit or exec: in exit, libraries behind OpenImageIO wait for threads
 * that only its parent has. options and facts may be NULL. */
LGD_API int lgd_read_photo(const char *path, int side, const lgd_read_options *options, float *image, lgd_facts *facts,
                           lgd_error *error);

/* An image as lgd_options.mask: side x side values, 1 where its largest centred square is neither black nor
 * transparent. width x height: of the photograph, whose shape it must have; 0: it may have any. */
LGD_API int lgd_read_mask(const char *path, int side, int width, int height, const lgd_read_options *options,
                          unsigned char *mask, lgd_error *error);

/* What lgd_read_photo does, of a photograph in memory: height x width x 3 values, top row first. LGD_SRGB8: unsigned
 * char, LGD_SRGB16: unsigned short, of sRGB; LGD_LINEAR: float. Not as published weights want it. */
enum { LGD_SRGB8, LGD_SRGB16, LGD_LINEAR };
LGD_API int lgd_square(const void *pixels, int encoding, int width, int height, int side, float *image,
                       lgd_error *error);

/* Numbers of maps.exr; LGD_EXR_AUTO: floats up to 512 x 512 pixels, else half floats. */
enum { LGD_EXR_AUTO, LGD_EXR_HALF, LGD_EXR_FLOAT };

/* All zero but size is the default. */
typedef struct lgd_write_options {
    size_t size;          /* sizeof(lgd_write_options) */
    const char *maps;     /* what is written, a list as of lgd-infer --maps: "normal,height"; NULL: diffuse, specular,
                           * roughness, normal, exr, preview, and render where the photograph's image is given */
    int directx;          /* normals with y down; not with glTF and MaterialX */
    int metallic;         /* base colour and metalness in place of diffuse and specular; not with MaterialX */
    int seamless;         /* the maps are made to repeat; side must be 16 or more */
    int exr;              /* LGD_EXR_... */
    int threads;          /* 0: as many as the process may use */
    const char *fov_from; /* where the field of view is known from, for meta.txt, one line; NULL: "given" */
    int fov_unknown;      /* fov_from says why it is not known: meta.txt then says "assumed: " before it where the
                           * camera is as high as lgd_flash_photo's, else "estimated: " */
    double ambient;       /* that was found (lgd_options.ambient), for render, page and meta.txt */
} lgd_write_options;

/* Writes maps as returned by lgd_estimate, and meta.txt, into folder, whose parent exists. All files appear together
 * when they are complete; a failure leaves what was there, but for one amid the renames into a folder that was there,
 * which leaves a meta.txt that begins with "incomplete". Files that an earlier call wrote there for other maps are
 * removed. Values that are not finite are an error. photo: with light and camera as they were taken
 * (lgd_options.taken) and the image that was read, side x side, for render and page; NULL: lgd_flash_photo(NULL).
 * options may be NULL. */
LGD_API int lgd_write_maps(const char *folder, const float *maps, int side, const lgd_photo *photo,
                           const lgd_write_options *options, lgd_error *error);

LGD_API const char *lgd_version(void);

#ifdef __cplusplus
}
#endif
#endif
