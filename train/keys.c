/* The table of all configuration keys. */
#include "train/config.h"
#include <stddef.h>

static const char *const encoding_names[] = {"raw", "asinh", NULL}; /* as nn_gradient */
static const char *const rmse_names[] = {"start", "batch", NULL}; /* as nn_rmse */

#define AT(field) offsetof(tr_config, field)

const tr_key tr_keys[] = {
    {"model", "g_width", TR_INT, AT(arch.g_width), 1, 1024, NULL, NULL, false, "channels of g's first convolution; level i has g_width * 2^i"},
    {"model", "g_width_max", TR_INT, AT(arch.g_width_max), 1, 4096, NULL, NULL, false, "most channels that a level of g has"},
    {"model", "g_levels", TR_INT, AT(arch.g_levels), 1, 8, NULL, NULL, false, "down blocks of g"},
    {"model", "g_kernel_first", TR_INT, AT(arch.g_kernel_first), 1, 15, NULL, NULL, false, "kernel side of g's first down block, odd"},
    {"model", "g_kernel", TR_INT, AT(arch.g_kernel), 1, 15, NULL, NULL, false, "kernel side of g's other blocks, odd"},
    {"model", "g_size", TR_INT, AT(arch.g_size), 2, 4096, NULL, NULL, false,
     "side in pixels that g works at, a multiple of 2^g_levels; other photographs are resampled for g"},
    {"model", "h_width", TR_INT, AT(arch.h_width), 0, 4096, NULL, NULL, false, "channels of the refiner's convolutions; 0: no refiner"},
    {"model", "h_gru", TR_INT, AT(arch.h_gru), 1, 4096, NULL, NULL, false, "channels of the refiner's recurrent states"},
    {"model", "iterations", TR_INT, AT(arch.iterations), 0, 64, NULL, NULL, false,
     "refinement steps T that the model is trained for and validated with"},
    {"model", "recurrent", TR_BOOL, AT(arch.recurrent), 0, 1, NULL, NULL, false, "the refiner carries its states from step to step"},
    {"model", "gradient", TR_BOOL, AT(arch.gradient), 0, 1, NULL, NULL, false, "the refiner reads the renderer's gradient (no: zeros, the ablation)"},
    {"model", "mean_before_norm", TR_BOOL, AT(arch.mean_before_norm), 0, 1, NULL, NULL, false,
     "g's global track takes its means before the normalisation (no: after it, as published)"},
    {"model", "rmse", TR_CHOICE, AT(arch.rmse), 0, 1, NULL, rmse_names, false,
     "what scales the gradient: the RMSE of each image's R_0, or of the whole batch anew at every step (published)"},
    {"model", "encoding", TR_CHOICE, AT(arch.encoding), 0, 1, NULL, encoding_names, false,
     "how the refiner reads the gradient: as it is (raw, published), or asinh of ten times it"},

    {"data", "seed", TR_INT64, AT(data.seed), 0, 1e15, "1", NULL, false, "seed of the materials and of the camera's noise"},
    {"data", "families", TR_FAMILIES, AT(data.families), 0, 0, "all", NULL, false,
     "procedural families to draw from: names, or all, or all with some removed (all, -wood)"},
    {"data", "noise", TR_REAL, AT(data.noise), 0, 1, "0.3", NULL, false, "most sensor noise: 0 none, 1 a phone at night"},
    {"data", "blur", TR_REAL, AT(data.blur), 0, 8, "0.7", NULL, false, "largest blur: sigma in pixels of a 256 x 256 photograph"},
    {"data", "quantise", TR_BOOL, AT(data.quantise), 0, 1, "yes", NULL, false, "photographs are rounded to 8 bits sRGB"},
    {"data", "patch", TR_INT, AT(data.patch), 8, 1024, "64", NULL, false, "side of the training materials in pixels"},
    {"data", "prefetch", TR_INT, AT(data.prefetch), 1, 64, "4", NULL, true, "batches made ahead of time"},
    {"data", "threads", TR_INT, AT(data.threads), 1, 64, "1", NULL, true, "background threads that make materials"},

    {"train", "batch", TR_INT, AT(train.batch), 1, 1024, "8", NULL, false, "materials in a step"},
    {"train", "window", TR_INT, AT(train.window), 0, 1024, "0", NULL, false,
     "side of the window of each patch that is refined and compared when g and h are trained together, g seeing the whole; 0: whole patches"},
    {"train", "pretrain_steps", TR_INT64, AT(train.pretrain_steps), 0, 1e9, "0", NULL, false, "steps that train g alone on R_0, before the others"},
    {"train", "steps", TR_INT64, AT(train.steps), 0, 1e9, "1000", NULL, false, "steps that train g and h together, after pretrain_steps"},
    {"train", "pretrain_rate", TR_REAL, AT(train.pretrain_rate), 0, 1e6, "0.001", NULL, false, "Adam's peak rate while g is trained alone"},
    {"train", "pretrain_floor", TR_REAL, AT(train.pretrain_floor), 0, 1, "0.1", NULL, false, "fraction of pretrain_rate that its cosine ends at"},
    {"train", "rate", TR_REAL, AT(train.rate), 0, 1e6, "0.001", NULL, false, "Adam's peak rate while g and h are trained together"},
    {"train", "g_rate", TR_REAL, AT(train.g_rate), 0, 10, "1", NULL, false,
     "factor of rate for g while g and h are trained together: a pretrained g needs less"},
    {"train", "rate_floor", TR_REAL, AT(train.rate_floor), 0, 1, "0", NULL, false, "fraction of rate that its cosine ends at"},
    {"train", "warmup", TR_INT64, AT(train.warmup), 0, 1e9, "100", NULL, false,
     "steps of linear warm-up at the start of either phase (at most half of it)"},
    {"train", "clip", TR_REAL, AT(train.clip), 0, 1e9, "1", NULL, false, "largest norm of the gradient, longer ones are scaled to it; 0: no limit"},
    {"train", "spike", TR_REAL, AT(train.spike), 0, 1e9, "8", NULL, false,
     "a step whose gradient is so many times longer than the recent mean is skipped; 0: none is"},
    {"train", "ema", TR_REAL, AT(train.ema), 0, 0.999999, "0.999", NULL, false,
     "decay of the moving average of the weights, which is what is validated and saved; 0: the weights themselves"},
    {"train", "start_weight", TR_REAL, AT(train.start_weight), 0, 1e3, "1", NULL, false, "weight of R_0's loss beside R_T's"},
    {"train", "map_weight", TR_REAL, AT(train.map_weight), 0, 1e3, "1", NULL, false, "weight of the maps' L1 beside the rendering loss"},
    {"train", "iterations_min", TR_INT, AT(train.iterations_min), 0, 64, "0", NULL, false,
     "fewest refinement steps in a training step, drawn uniformly; 0: model.iterations"},
    {"train", "iterations_max", TR_INT, AT(train.iterations_max), 0, 64, "0", NULL, false, "most refinement steps; 0: model.iterations"},
    {"train", "seed", TR_INT64, AT(train.seed), 0, 1e15, "1", NULL, false, "seed of the initial weights, the loss's views and the drawn iterations"},
    {"train", "checkpoint_every", TR_INT64, AT(train.checkpoint_every), 1, 1e9, "500", NULL, true, "steps between checkpoints"},
    {"train", "log_every", TR_INT64, AT(train.log_every), 1, 1e9, "50", NULL, true, "steps between lines of progress when stderr is no terminal"},
    {"train", "max_skipped", TR_INT, AT(train.max_skipped), 0, 1000000, "20", NULL, true,
     "steps in a row that may be skipped (no finite loss and gradient, or a spike); one more ends the run"},
    {"train", "init", TR_TEXT, AT(train.init), 0, sizeof((tr_config *)0)->train.init, "", NULL, true,
     "weights file whose parameters of the same name and shape the run begins with"},

    {"validate", "every", TR_INT64, AT(validate.every), 0, 1e9, "500", NULL, false, "steps between validations (and one at the end); 0: never"},
    {"validate", "seed", TR_INT64, AT(validate.seed), 0, 1e15, "1000001", NULL, false, "seed of the validation materials, another than data.seed"},
    {"validate", "count", TR_INT, AT(validate.count), 1, 4096, "32", NULL, false, "validation materials"},
    {"validate", "size", TR_INT, AT(validate.size), 8, 2048, "64", NULL, false, "their side in pixels"},

    {"output", "folder", TR_TEXT, AT(output.folder), 0, sizeof((tr_config *)0)->output.folder, "", NULL, true,
     "where the run's files go; empty: runs/NAME, from the configuration NAME.ini"},
};
const int tr_key_count = (int)(sizeof tr_keys / sizeof *tr_keys);
