/* The method: the architecture as plain data, the parameters in one block, and the unrolled loop. */
#ifndef NN_MODEL_H
#define NN_MODEL_H
#include "autograd/tape.h"
#include "nn/coder.h"
#include "render/posterior.h"
#include "render/scene.h"

typedef enum nn_rmse {
    NN_RMSE_START, /* per image, taken once, from what the steps at a size begin with (ours) */
    NN_RMSE_BATCH  /* over the whole batch, anew at every step (published) */
} nn_rmse;

typedef enum nn_gradient {
    NN_GRADIENT_RAW,  /* as it is (published) */
    NN_GRADIENT_ASINH /* asinh(NN_GRADIENT_SCALE x): near a sharp highlight the gradient is thousands of times that
                       * elsewhere, and a network that reads both as they are learns from neither (docs/math.md) */
} nn_gradient;
#define NN_GRADIENT_SCALE 10.0f

typedef enum nn_compat {
    NN_COMPAT_NONE,
    NN_COMPAT_PUBLISHED /* Luo et al.'s code: its names of tensors, the linears that it has and never uses, its flash
                         * renderer (render/published.h), its photographs (infer/photograph.h) */
} nn_compat;

/* What is added to the maps beside h, through a learned matrix (docs/math.md, S4). */
typedef enum nn_descent {
    NN_DESCENT_NONE,     /* nothing (published) */
    NN_DESCENT_GRADIENT, /* the encoded gradients */
    NN_DESCENT_NEWTON,   /* the step of Gauss and Newton's method that fits each pixel to its photographs
                          * (rd_newton_step), by a learned 9 x 9 matrix */
    NN_DESCENT_POSTERIOR /* the whole step to the most probable maps (render/posterior.h); R_0 and what g says of its
                          * errors are the prior */
} nn_descent;

/* The architecture, in the metadata of a weights file with one key each. */
enum { NN_MAX_IMAGES = 9 };
typedef struct nn_arch {
    int images;   /* photographs of a material that are read at once, each with its own light and view; fewer may be
                     given */
    int channels; /* of the maps: 9, or 10 (published) */
    int g_width;  /* of g's first convolution; level i has min(g_width * 2^i, g_width_max) */
    int g_width_max;
    int g_levels;       /* down blocks, 1 .. 8 */
    int g_kernel_first; /* of the first down block: odd */
    int g_kernel;       /* of all others */
    int g_unshuffle;    /* r: g reads photographs of r g_size pixels a side, squares of r x r pixels as channels of one,
                         * and writes R_0 at that size with what nn/detail.c adds; 1: R_0 has g_size pixels a side */
    int g_detail;       /* channels of what adds the detail, where g_unshuffle is above 1 */
    int g_trunk;        /* its residual blocks */
    int g_half;         /* channels of what it adds at half of the photograph's side; 0: nothing */
    bool conditions;    /* g reads what is known of each photograph's camera, light and exposure (nn_known) */
    bool spread;        /* g says how far each map may be off (nn_guess) */
    bool scene;         /* g guesses what is not known of camera and light (nn_guess) */
    int g_size;  /* side in pixels that g works at (a multiple of 2^g_levels); a photograph of another size is resampled
                    for g */
    int h_width; /* of h's convolutions; 0: h is what descent lets past it, or, where iterations is 0 or descent none,
                    nothing */
    int h_gru;   /* of h's states */
    int coarse_steps; /* of the iterations, the first that many refine maps of coarse_size pixels a side, by a network
                         of h's kind but with parameters of its own */
    int coarse_size; /* a smaller photograph has its own size; this and the next are of no meaning where coarse_steps is
                        0 */
    int coarse_width;      /* of that network's convolutions */
    int coarse_gru;        /* of its states */
    int revisions;         /* of several photographs' maps by h at g's full size, before the steps of
                            * NN_DESCENT_POSTERIOR (nn/revise.h); 0: none */
    int revise_width;      /* of that h; of no meaning where revisions is 0 */
    int iterations;        /* T that it was trained for, beside the revisions */
    bool recurrent;        /* h carries its states from step to step */
    bool gradient;         /* h reads the gradient (false: zeros, an ablation) */
    bool mean_before_norm; /* the global track's mean: before (ours) or after (published) the normalisation */
    nn_rmse rmse;
    nn_gradient encoding; /* of the gradient for h */
    nn_descent descent;
    nn_compat compat;
} nn_arch;

nn_arch nn_arch_default(void);
int nn_arch_side(const nn_arch *a); /* pixels a side of R_0 */
ts_code nn_arch_check(const nn_arch *a, ts_status *st);
/* Of one material at once: g reads `images` of them, the steps to the most probable maps fit any that are given. */
int nn_most_photographs(const nn_arch *a);
bool nn_arch_refines(const nn_arch *a);      /* there is something to do steps with */
bool nn_arch_refines_full(const nn_arch *a); /* at the photograph's size */
bool nn_arch_reads(const nn_arch *a); /* those steps read the gradient, which the RMSE of what they begin with scales */
/* Steps that are usual with so many photographs of one material: the iterations; of several, where they go to the most
 * probable maps, which takes more of them, twice as many. */
int nn_arch_steps(const nn_arch *a, int photographs);
/* Of so many steps those that are revisions, R_1 and so on: of several photographs of which all is known (nn_known). */
int nn_arch_revisions(const nn_arch *a, int photographs, int known, int steps);
bool nn_arch_carries(const nn_arch *a); /* they have states */

typedef struct nn_param {
    char name[96];
    int rank, dim[4];     /* convolution [oc, ic, k, k], linear [out, in], bias [out] */
    size_t offset, count; /* floats into the blocks */
    const void *half;     /* NULL, or where its values are as halves: not in the block (nn_model_open) */
} nn_param;

typedef struct nn_model {
    nn_arch arch;
    nn_coder coder; /* code is not 0: an auto-encoder (nn/coder.h), and arch says nothing */
    nn_param *param;
    int params;
    size_t count;         /* floats in a block (each parameter starts at a multiple of 16) */
    float *value;         /* one aligned block */
    float *grad;          /* the same, or NULL until nn_model_train */
    bool fixed[3];        /* nn_part: its parameters are constants, no gradient is computed for them */
    void *layers;         /* nn's own */
    struct nn_file *file; /* or NULL: what its halves are in */
    bool g_once;          /* g runs once: its packed weights are not kept (ag_pass) */
} nn_model;

/* The list of parameters, without values: value is NULL. The caller frees. NULL and st on failure. */
nn_model *nn_model_plan(const nn_arch *arch, ts_status *st);

/* Parameters are allocated and zero. The caller frees. NULL and st on failure. */
nn_model *nn_model_create(const nn_arch *arch, ts_status *st);
void nn_model_free(nn_model **model);

/* Three runs of the block, in this order. */
typedef enum nn_part {
    NN_G,     /* or the auto-encoder */
    NN_H,     /* what refines at the photograph's size */
    NN_COARSE /* what refines at coarse_size */
} nn_part;

/* Allocates the gradient block (zero); idempotent. */
ts_code nn_model_train(nn_model *model, ts_status *st);

/* Kaiming for what a leaky ReLU or SELU follows, orthogonal for the recurrent weights, sigma 1e-3 for h's last layer,
 * zero biases. */
void nn_model_init(nn_model *model, uint64_t seed);

/* Where the values of the parameter at weight are as halves, or NULL: what ag_halves_from asks. */
const void *nn_model_halves(const float *weight, void *model);

const nn_param *nn_model_find(const nn_model *model, const char *name);
/* The parameters of a part alone: [first, last) in floats of the block. */
void nn_model_range(const nn_model *model, nn_part part, size_t *first, size_t *last);

/* What is known of a photograph's scene: a model with arch.conditions reads it, others assume all of it. */
typedef enum nn_known {
    NN_KNOWN_CAMERA =
        1, /* its height, as of a field of view; of its place beside the centre the first guess may move it */
    NN_KNOWN_LIGHT = 2, /* its place */
    NN_KNOWN_POWER = 4, /* the light's */
    NN_KNOWN_ALL = 7
} nn_known;

/* A batch of N materials with `given` photographs each, material by material; linear, clamped to [0, 1]. g reads whole
 * photographs; the steps refine any window of them. */
typedef struct nn_input {
    ts_tensor image; /* [N * given, h, w, 3]: the part that is refined, the grid's pixels */
    rd_grid grid;    /* of every photograph */
    rd_view view;    /* of every photograph where views is NULL: the flash */
    ts_tensor whole; /* [N * given, side, side, 3]: the photographs of which image is a window; no data: image is the
                        whole */
    const rd_view *views;       /* [N * given], or NULL */
    const unsigned char *known; /* [N * given] of nn_known: what of views is true; NULL: all of it */
    int given;                  /* 1 .. nn_most_photographs; 0 stands for 1 */
    int tellings;               /* of 2 or more g is told the photographs' scenes so many times: views and known are
                                   [tellings][N * given], and R_0 is made of the mean of what the U-Net says then. On a
                                   tape without gradients, else the tape gets an error; the steps have the first. 0
                                   stands for 1 */
    const float *parts;         /* [tellings], in that mean; their sum is 1. Of one telling not read */
    int orientations; /* 2, 4, 8: R_0 is the mean of g's maps over so many orientations of the photograph (as it is and
                       * a quarter turn, all quarter turns, and their mirror images), if nn_orients; on a tape without
                       * gradients. 0, 1: as it is */
    const float *r0;  /* R_0 of these photographs in these orientations, [N, side, side, channels] as
                       * nn_coarse_steps gives it; NULL: g is run */
    bool recompute;   /* on a tape with gradients: keep only R_t and h's states of each step, and compute the rest again
                         for the gradient */
} nn_input;

/* What g makes of photographs. spread and scene are NULL where the architecture does not have them. */
typedef struct nn_guess {
    ag_value *maps;   /* R_0, [N, side, side, channels], side = nn_arch_side */
    ag_value *spread; /* [N, side, side, NN_SPREADS]: the logarithm of the expected absolute error of diffuse, normal,
                       * roughness and F0, in the encoding of tensor/maps.h, over NN_SPREAD_UNIT */
    ag_value *scene;  /* [tellings N, 1, 1, 2 RD_SCENE_NUMBERS]: render/scene.h's numbers of the photograph, then the
                       * logarithms of their expected absolute errors */
} nn_guess;
enum { NN_SPREADS = 4 };
#define NN_SPREAD_UNIT 0.1f
extern const signed char nn_spread_of[]; /* of each of MAP_CHANNELS channels */

/* False after an error, which the tape has. */
bool nn_guess_from(ag_tape *tape, const nn_model *model, const nn_input *in, nn_guess *guess);

/* R_0 of the whole photographs: [N, S, S, channels]. Missing photographs are black. Includes the log encoding and the
 * resampling to g_size and back. */
ag_value *nn_predict(ag_tape *tape, const nn_model *model, const nn_input *in);

/* What looks at the steps. */
typedef struct nn_watch {
    bool (*after)(int step, const ag_value *maps,
                  void *user); /* called with every R_t; false: stop here, the rest of maps is filled with it */
    void *user;
    bool ends_alone; /* after gets only the maps of R_0 and R_steps, which saves resampling, and NULL between */
} nn_watch;

/* maps[0] = R_0 at nn_arch_side, maps[1] … maps[steps] at coarse_size or the photographs' size, by g and the coarse
 * steps: steps <= arch.coarse_steps. after (may be NULL): called with t when maps[t] is there; false: stop. */
ts_code nn_coarse_steps(ag_tape *tape, const nn_model *model, const nn_input *in, int steps, ag_value **maps,
                        bool (*after)(int t, void *user), void *user);

/* g reads one photograph, its light and camera are above the centre, and the weights are not published ones. */
bool nn_orients(const nn_model *model, const nn_input *in);

/* How many pixels away from an output pixel h reads, in one step. */
int nn_refiner_reach(const nn_model *model);
/* The same of all steps first .. end - 1 of these photographs, by h or to the most probable maps. */
int nn_steps_reach(const nn_model *model, const nn_input *in, int first, int end);
/* Whether the steps want nn_state.burnt. */
bool nn_settles_burnt(const nn_model *model, const nn_input *in);

/* What is carried from step to step; zero-initialise it. */
typedef struct nn_state {
    ag_value *gru[2],
        *to[2];     /* to: NULL, or where the new states are written (a tape without gradients); to[i] may be gru[i] */
    ag_value *into; /* NULL, or where nn_refine writes R_{t+1} (a tape without gradients); may be R_t */
    float *mean, *deviation; /* NN_DESCENT_POSTERIOR: R_0 and its errors' standard deviations in the grid's window,
                              * [h, w, channels] and [h, w, NN_SPREADS]; nn_steps cuts them where it cuts the window */
    float *burnt;            /* the same: nn/burnt.h's of the window's photograph, [h, w], or NULL */
    float *best, *misfit;    /* of several photographs: what rd_search keeps, [h, w, MAP_CHANNELS] and [h, w] */
    double *rmse0; /* of each whole photograph by what the steps at this size begin with, in the tape's arena; NULL:
                      nn_refine measures it on its maps */
    int step;      /* steps done; those beyond arch.iterations are shortened (docs/math.md, S7), but if compat is
                      published or descent NN_DESCENT_POSTERIOR */
} nn_state;

/* Of NN_DESCENT_POSTERIOR: how colours hang together, and how far a rendering of the right maps is from a photograph of
 * which known (nn_known) is true, one of so many of the material. */
ts_prior nn_step_prior(int known, int photographs);

/* A step at the photograph's size (docs/math.md, S4): R_{t+1} = R_t + h(R_t, e) + D p. e is dL/dR_t, encoded
 * (arch.encoding), one for each photograph (zero for a missing one). D is a learned matrix over the channels, and p
 * depends on arch.descent:
 *     NN_DESCENT_NEWTON    the Newton step, damped by 0.1, in F0 by 1; D begins as half the identity
 *     NN_DESCENT_GRADIENT  e; D begins as -0.003 times the identity: an untrained loop is plain descent
 *     NN_DESCENT_POSTERIOR the step to the most probable maps; D is the identity
 *     NN_DESCENT_NONE      0, as published */
ag_value *nn_refine(ag_tape *tape, const nn_model *model, const nn_input *in, ag_value *maps, nn_state *state);

/* RMSE(R_t) = nn_rmse_of what nn_add_squares leaves: squares[i] += the squared differences between photograph i of in
 * [N given] and the rendering of its material's maps [N, h, w, channels], summed over the grid's pixels and averaged
 * over red, green and blue. Windows of a photograph add up. */
void nn_add_squares(const nn_model *model, const nn_input *in, const float *maps, int channels, double *squares);
double nn_rmse_of(const double *squares, int photographs, double pixels);

/* Steps at the photograph's size, of a window. */
typedef struct nn_loop {
    nn_input in;      /* image and grid: the window of R_t. On a tape without gradients the image is overwritten where
                         the window shrinks */
    rd_grid core;     /* what of R_steps is wanted: the window shrinks towards it by h's reach at every step. The grid
                         itself: the window stays as it is */
    int steps;        /* up to R_steps */
    nn_state state;   /* step: how many are done */
    bool keep_all;    /* as in nn_lgd */
    double tolerance; /* on a tape without gradients: the maps change no more after a step that changes them by less
                         (RMS over the window); 0: they always do */
    const nn_watch *watch; /* or NULL; sees in */
    int made;              /* out: steps that changed the maps */
} nn_loop;

/* The loop. maps: as nn_lgd leaves them, of which R_{state.step} is given. On a tape without gradients R_t overwrites
 * it, but for keep_all. */
ts_code nn_steps(ag_tape *tape, const nn_model *model, nn_loop *loop, ag_value **maps);

/* The unrolled loop on the grid's window. The first arch.coarse_steps steps refine R_t at coarse_size with the
 * parameters of NN_COARSE (nn/coarse.c); their result is resampled, and the others go on from it with nn_steps.
 * keep_all: maps[0] = R_0 … maps[steps] = R_T. Otherwise maps[0] = R_T, and on a tape without gradients intermediate
 * memory is released. */
ts_code nn_lgd(ag_tape *tape, const nn_model *model, const nn_input *in, int steps, bool keep_all, ag_value **maps,
               const nn_watch *watch);
#endif
