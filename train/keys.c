/* The table of all configuration keys. */
#include "train/config.h"
#include <stddef.h>

static const char *const encoding_names[] = {"raw", "asinh", NULL};              /* as nn_gradient */
static const char *const compat_names[] = {"none", "published", NULL};           /* as nn_compat */
static const char *const descent_names[] = {"none", "gradient", "newton", NULL}; /* as nn_descent */
static const char *const precision_names[] = {"f32", "bf16", NULL};              /* as ts_precision */
static const char *const rmse_names[] = {"start", "batch", NULL};                /* as nn_rmse */

#define AT(field) offsetof(tr_config, field)

const tr_key tr_keys[] = {
    {"model", "images", TR_INT, AT(arch.images), 1, NN_MAX_IMAGES, NULL, NULL, false,
     "largest number of photographs of a material that the model reads; above 1 they are taken under some of nine "
     "known "
     "lights (docs/math.md, S14)"},
    {"model", "channels", TR_INT, AT(arch.channels), 9, 10, NULL, NULL, false,
     "channels of the maps; 10: with the light's intensity, which nothing reads (published)"},
    {"model", "g_width", TR_INT, AT(arch.g_width), 1, 1024, NULL, NULL, false,
     "channels of g's first convolution; level i has g_width * 2^i"},
    {"model", "g_width_max", TR_INT, AT(arch.g_width_max), 1, 4096, NULL, NULL, false,
     "largest number of channels of a level of g"},
    {"model", "g_levels", TR_INT, AT(arch.g_levels), 1, 8, NULL, NULL, false, "down blocks of g"},
    {"model", "g_kernel_first", TR_INT, AT(arch.g_kernel_first), 1, 15, NULL, NULL, false,
     "kernel side of g's first down block, odd"},
    {"model", "g_kernel", TR_INT, AT(arch.g_kernel), 1, 15, NULL, NULL, false, "kernel side of g's other blocks, odd"},
    {"model", "g_size", TR_INT, AT(arch.g_size), 2, 4096, NULL, NULL, false,
     "side in pixels of what g reads, a multiple of 2^g_levels; other photographs are resampled for g"},
    {"model", "h_width", TR_INT, AT(arch.h_width), 0, 4096, NULL, NULL, false,
     "channels of h's convolutions; 0: no h, a step is then what model.descent gives"},
    {"model", "h_gru", TR_INT, AT(arch.h_gru), 1, 4096, NULL, NULL, false, "channels of h's recurrent states"},
    {"model", "coarse_steps", TR_INT, AT(arch.coarse_steps), 0, 64, NULL, NULL, false,
     "number of first steps that refine the maps at coarse_size, with a network of their own; the others work at the "
     "photograph's size"},
    {"model", "coarse_size", TR_INT, AT(arch.coarse_size), 1, 4096, NULL, NULL, false,
     "side in pixels of the maps in the coarse steps, at most the photograph's"},
    {"model", "coarse_width", TR_INT, AT(arch.coarse_width), 1, 4096, NULL, NULL, false,
     "channels of the coarse network's convolutions"},
    {"model", "coarse_gru", TR_INT, AT(arch.coarse_gru), 1, 1024, NULL, NULL, false,
     "channels of the coarse network's recurrent states"},
    {"model", "iterations", TR_INT, AT(arch.iterations), 0, 64, NULL, NULL, false,
     "refinement steps T that the model is trained for and validated with"},
    {"model", "recurrent", TR_BOOL, AT(arch.recurrent), 0, 1, NULL, NULL, false,
     "h carries its states from step to step"},
    {"model", "gradient", TR_BOOL, AT(arch.gradient), 0, 1, NULL, NULL, false,
     "h reads the gradient of the reconstruction error (no: zeros, an ablation)"},
    {"model", "descent", TR_CHOICE, AT(arch.descent), 0, NN_DESCENT_NEWTON, NULL, descent_names, false,
     "what is added to the maps beside h, through a learned matrix over the channels: nothing (none, published), the "
     "gradient, or the Gauss-Newton step of each pixel (newton)"},
    {"model", "mean_before_norm", TR_BOOL, AT(arch.mean_before_norm), 0, 1, NULL, NULL, false,
     "g's global track takes its means before the normalisation (no: after it, as published)"},
    {"model", "rmse", TR_CHOICE, AT(arch.rmse), 0, 1, NULL, rmse_names, false,
     "what the gradient is divided by: the RMSE of each photograph by R_0 (start), or of the whole batch at every step "
     "(batch, published)"},
    {"model", "compat", TR_CHOICE, AT(arch.compat), 0, 1, NULL, compat_names, false,
     "published: the published code's names of tensors and unused layers, flash renderer and preparation of "
     "photographs"},
    {"model", "encoding", TR_CHOICE, AT(arch.encoding), 0, 1, NULL, encoding_names, false,
     "how h reads the gradient: as it is (raw, published), or asinh of ten times it"},

    {"coder", "code", TR_INT, AT(coder.code), 0, 1024, "0", NULL, false,
     "channels of the code of an auto-encoder of maps, which is then what is trained (train.steps; model.h_width and "
     "model.iterations are 0); 0: g and h"},
    {"coder", "width", TR_INT, AT(coder.width), 1, 1024, "32", NULL, false,
     "channels of its first level; level i has width * 2^i"},
    {"coder", "width_max", TR_INT, AT(coder.width_max), 1, 4096, "128", NULL, false, "most channels that a level has"},
    {"coder", "levels", TR_INT, AT(coder.levels), 1, 8, "3", NULL, false,
     "levels: the code has a 2^levels-th of the maps' side"},

    {"data", "seed", TR_INT64, AT(data.seed), 0, 1e15, "1", NULL, false,
     "seed of the materials and of the camera's noise"},
    {"data", "families", TR_FAMILIES, AT(data.families), 0, 0, "all", NULL, false,
     "procedural families to draw from: names, or all, or all with some removed (all, -wood)"},
    {"data", "noise", TR_REAL, AT(data.noise), 0, 1, "0.3", NULL, false,
     "largest sensor noise: 0 none, 1 a phone at night"},
    {"data", "noise_spread", TR_REAL, AT(data.noise_spread), 0, 3, "1", NULL, false,
     "read noise and shot noise are each up to this many stops stronger or weaker"},
    {"data", "blur", TR_REAL, AT(data.blur), 0, 8, "0.7", NULL, false,
     "largest blur: sigma in pixels of a 256 x 256 photograph"},
    {"data", "exposure", TR_REAL, AT(data.exposure), 0, 3, "0.1", NULL, false,
     "photographs are up to this many stops brighter or darker than under the default light"},
    {"data", "vignette", TR_REAL, AT(data.vignette), 0, 0.9, "0.1", NULL, false,
     "largest share of the light that is lost in the corners"},
    {"data", "white_balance", TR_REAL, AT(data.white_balance), 0, 0.9, "0.03", NULL, false,
     "red and blue are each up to this share stronger or weaker"},
    {"data", "tilt", TR_REAL, AT(data.tilt), 0, 30, "2", NULL, false,
     "largest angle between the camera's axis and the normal, in degrees"},
    {"data", "off_centre", TR_REAL, AT(data.off_centre), 0, 0.4, "0.02", NULL, false,
     "largest distance of the camera's axis from the patch's centre, in patch widths"},
    {"data", "jpeg", TR_INT, AT(data.jpeg), 0, 98, "75", NULL, false,
     "lowest quality of the photographs' JPEG, drawn up to 98, half of them with halved chroma; 0: no JPEG"},
    {"data", "quantise", TR_BOOL, AT(data.quantise), 0, 1, "yes", NULL, false,
     "photographs are rounded to 8 bits sRGB (JPEG does so in any case)"},
    {"data", "patch", TR_INT, AT(data.patch), 8, 1024, "64", NULL, false, "side of the training materials in pixels"},
    {"data", "prefetch", TR_INT, AT(data.prefetch), 1, 64, "4", NULL, true, "batches that are made in advance"},
    {"data", "threads", TR_INT, AT(data.threads), 1, 64, "1", NULL, true, "background threads that make materials"},

    {"train", "batch", TR_INT, AT(train.batch), 1, 1024, "8", NULL, false, "materials in a step"},
    {"train", "window", TR_INT, AT(train.window), 0, 1024, "0", NULL, false,
     "side of the window of each patch that h refines and the loss compares; g reads the whole patch; 0: whole "
     "patches"},
    {"train", "pretrain_steps", TR_INT64, AT(train.pretrain_steps), 0, 1e9, "0", NULL, false,
     "steps that train g alone on R_0, before train.steps"},
    {"train", "steps", TR_INT64, AT(train.steps), 0, 1e9, "1000", NULL, false,
     "steps that train g and h together, after pretrain_steps"},
    {"train", "pretrain_rate", TR_REAL, AT(train.pretrain_rate), 0, 1e6, "0.001", NULL, false,
     "Adam's peak rate while g is trained alone"},
    {"train", "pretrain_floor", TR_REAL, AT(train.pretrain_floor), 0, 1, "0.1", NULL, false,
     "the rate's cosine ends at this fraction of pretrain_rate"},
    {"train", "rate", TR_REAL, AT(train.rate), 0, 1e6, "0.001", NULL, false,
     "Adam's peak rate while g and h are trained together"},
    {"train", "g_rate", TR_REAL, AT(train.g_rate), 0, 10, "1", NULL, false,
     "factor on rate for g while g and h are trained together; a pretrained g needs less; 0: g is fixed, and no "
     "gradient "
     "is computed for it"},
    {"train", "coarse_rate", TR_REAL, AT(train.coarse_rate), 0, 10, "1", NULL, false,
     "factor on rate for the network of the coarse steps; 0: it is fixed"},
    {"train", "rate_floor", TR_REAL, AT(train.rate_floor), 0, 1, "0", NULL, false,
     "the rate's cosine ends at this fraction of rate"},
    {"train", "warmup", TR_INT64, AT(train.warmup), 0, 1e9, "100", NULL, false,
     "steps of linear warm-up at the start of each phase (at most half of it)"},
    {"train", "clip", TR_REAL, AT(train.clip), 0, 1e9, "1", NULL, false,
     "largest norm of the gradient; longer ones are scaled down to it; 0: no limit"},
    {"train", "spike", TR_REAL, AT(train.spike), 0, 1e9, "8", NULL, false,
     "a step is skipped when its gradient is this many times longer than the recent mean; 0: never"},
    {"train", "ema", TR_REAL, AT(train.ema), 0, 0.999999, "0.999", NULL, false,
     "decay of the moving average of the weights, which is validated and saved; 0: the weights themselves"},
    {"train", "start_weight", TR_REAL, AT(train.start_weight), 0, 1e3, "1", NULL, false,
     "weight of R_0's loss beside R_T's"},
    {"train", "map_weight", TR_REAL, AT(train.map_weight), 0, 1e3, "1", NULL, false,
     "weight of the maps' L1 beside the rendering loss"},
    {"train", "iterations_min", TR_INT, AT(train.iterations_min), 0, 64, "0", NULL, false,
     "smallest number of refinement steps in a training step, drawn uniformly; 0: model.iterations"},
    {"train", "iterations_max", TR_INT, AT(train.iterations_max), 0, 64, "0", NULL, false,
     "largest number of refinement steps; 0: model.iterations"},
    {"train", "given_min", TR_INT, AT(train.given_min), 0, NN_MAX_IMAGES, "0", NULL, false,
     "smallest number of photographs in a training step, drawn uniformly up to model.images; 0: always model.images"},
    {"train", "checkpoint_steps", TR_BOOL, AT(train.checkpoint_steps), 0, 1, "no", NULL, true,
     "keep only the maps and h's states of each refinement step, and compute the rest again for the gradient: less "
     "memory, a third more time, the same numbers"},
    {"train", "precision", TR_CHOICE, AT(train.precision), 0, TS_PRECISION_COUNT - 1, "f32", precision_names, false,
     "operands of convolutions, forward and for the gradients of their inputs (with AMX of weights too): f32, or "
     "rounded "
     "to bf16, which is faster on CPUs with AMX or AMD's AVX512-BF16 and slower on others; weights, their gradients, "
     "Adam, sums and validation stay f32"},
    {"train", "exact", TR_BOOL, AT(train.exact), 0, 1, "no", NULL, false,
     "compute convolutions and their gradients directly; no: by Winograd's algorithm where it is faster, which differs "
     "by "
     "less than 1e-4"},
    {"train", "seed", TR_INT64, AT(train.seed), 0, 1e15, "1", NULL, false,
     "seed of the initial weights, the loss's views and the drawn iterations"},
    {"train", "checkpoint_every", TR_INT64, AT(train.checkpoint_every), 1, 1e9, "500", NULL, true,
     "steps between checkpoints"},
    {"train", "log_every", TR_INT64, AT(train.log_every), 1, 1e9, "50", NULL, true,
     "steps between lines of progress when stderr is not a terminal"},
    {"train", "max_skipped", TR_INT, AT(train.max_skipped), 0, 1000000, "20", NULL, true,
     "number of steps in a row that may be skipped (loss or gradient not finite, or train.spike); one more ends the "
     "run"},
    {"train", "init", TR_TEXT, AT(train.init), 0, sizeof((tr_config *)0)->train.init, "", NULL, true,
     "weights file to start from: its parameters of the same name and shape are taken"},
    {"train", "init_rest", TR_TEXT, AT(train.init_rest), 0, sizeof((tr_config *)0)->train.init_rest, "", NULL, true,
     "weights file for the parameters that train.init lacks, for example the coarse steps of another run"},

    {"validate", "every", TR_INT64, AT(validate.every), 0, 1e9, "500", NULL, false,
     "steps between validations (and one at the end); 0: never"},
    {"validate", "seed", TR_INT64, AT(validate.seed), 0, 1e15, "1000001", NULL, false,
     "seed of the validation materials; should differ from data.seed"},
    {"validate", "count", TR_INT, AT(validate.count), 1, 4096, "32", NULL, false, "number of validation materials"},
    {"validate", "size", TR_INT, AT(validate.size), 8, 2048, "64", NULL, false,
     "side of the validation materials in pixels"},

    {"output", "folder", TR_TEXT, AT(output.folder), 0, sizeof((tr_config *)0)->output.folder, "", NULL, true,
     "folder of the run's files; empty: runs/NAME for the configuration NAME.ini"},
};
const int tr_key_count = (int)(sizeof tr_keys / sizeof *tr_keys);
