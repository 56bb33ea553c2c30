/* Inside nn only: each layer's parameters in the model's list, and their first values. */
#ifndef NN_LAYERS_H
#define NN_LAYERS_H
#include "nn/model.h"

enum { NN_MAX_LEVELS = 8 };

/* Slopes of the leaky ReLUs, as published. */
#define NN_LEAK_G 0.2f
#define NN_LEAK_H 0.01f

typedef struct nn_layer {
    int weight, bias; /* indices into model->param; bias -1: none */
} nn_layer;

/* A down or up block of g: two convolutions, and the global track's way in and out. */
typedef struct nn_unet_block {
    nn_layer conv1, conv2;
    nn_layer add;    /* global -> what is added to the features (Linear1 going down, Linear3 going up) */
    nn_layer global; /* [mean of the features, global] -> new global (Linear2, Linear4) */
} nn_unet_block;

/* One convolution of h and the recurrent cell that reads it. */
typedef struct nn_cell {
    nn_layer conv, input, hidden;
} nn_cell;

/* The network of a step. */
typedef struct nn_refiner {
    int width, gru; /* width 0: no network, only descent */
    nn_cell cell[2];
    nn_layer output, descent; /* descent: of arch.descent, weight -1 where there is none */
} nn_refiner;

/* h of nn/revise.c: a small U-Net over squares of pixels, and three convolutions at the full size. Of a pair the first
 * layer is 1 x 1 where it reads channels of several kinds, all others are 3 x 3. */
enum { NN_REVISE_LEVELS = 2 };
typedef struct nn_reviser {
    nn_layer read[2], down[NN_REVISE_LEVELS][2], up[NN_REVISE_LEVELS][2];
    nn_layer global;  /* mean of the deepest features -> what is added to them */
    nn_layer squares; /* 1 x 1, to channels of the full size's pixels */
    nn_layer full[3];
} nn_reviser;

typedef struct nn_layers {
    nn_layer input_conv, input_global;
    nn_unet_block down[NN_MAX_LEVELS], up[NN_MAX_LEVELS];
    nn_layer output_conv1, output_conv2, output_add;
    nn_layer detail[5], trunk[NN_MAX_LEVELS][2], half[5]; /* nn/detail.c */
    nn_layer scene[2];                                    /* of the deepest global vector */
    nn_refiner h, coarse;
    nn_reviser revise;
    nn_layer encoder[NN_MAX_LEVELS + 1], code, decoder[NN_MAX_LEVELS + 1][2],
        decoded;   /* of an auto-encoder; the deepest decoder level has one convolution */
    int first[4];  /* index of each nn_part's first parameter, and their number */
    double *start; /* per parameter: standard deviation of the first values, 0 for zeros, or one of these: */
} nn_layers;
#define NN_ORTHOGONAL (-1.0)
/* 0.03 to 0.3 are within some percent of each other, from one photograph and from five. */
#define NN_NEWTON_DAMPING 0.1f
/* One photograph cannot separate F0 from albedo; with less, the detail of both goes into F0. */
#define NN_NEWTON_DAMPING_SPECULAR 1.0f
/* Half the identity: the equations are linear only near the maps. */
#define NN_NEWTON_START (-3.0)
/* -0.003 times the identity, shared by the photographs: six such steps lower the loss of a trained g's R_0 without
 * overshooting anywhere. */
#define NN_DESCENT_START (-2.0)

/* Channels of g's level 0 .. g_levels. */
int nn_level_width(const nn_arch *a, int level);

void nn_param_dims(const nn_param *p, int64_t dim[4]);
bool nn_all_finite(const float *v, size_t count);

/* Parameter number index as a value on the tape, NULL for index -1. */
ag_value *nn_parameter(ag_tape *tape, const nn_model *model, int index);
ag_value *nn_conv(ag_tape *tape, const nn_model *model, nn_layer layer, ag_value *x, int dilation, ts_pad pad,
                  float leak);
/* base + the convolution of x, without an activation. */
ag_value *nn_conv_add(ag_tape *tape, const nn_model *model, nn_layer layer, ag_value *base, ag_value *x, int dilation,
                      ts_pad pad);
/* constants: NULL, or further channels of the input, as ag_conv_with_constants has them. */
ag_value *nn_conv_with_constants(ag_tape *tape, const nn_model *model, nn_layer layer, ag_value *x, ag_value *constants,
                                 int dilation, ts_pad pad, float leak);
ag_value *nn_linear(ag_tape *tape, const nn_model *model, nn_layer layer, ag_value *x);

/* Channels of what is known of a photograph, for each pixel: the view direction's x and y and 1, or three zeros where
 * the camera's place is not known; the same of the light; the light's power over the square of its height, in stops
 * above the default flash's, and 1, or two zeros. */
enum { NN_CONDITIONS = 8, NN_COORDINATES = 2, NN_FRAME = 2 };

/* Channels that a revision reads of each pixel, and those of its convolutions at the full size (nn/revise.c). */
enum { NN_REVISION_READS = 34, NN_REVISION_FINE = 24 };

/* Channels of the photograph's pixels in squares and between the last two convolutions of nn_full_size. */
enum { NN_FINE = 12, NN_FINER = 16 };

/* Channels that g's first layers read, and that the last of nn_full_size writes: the maps', two of the shading's frame
 * (render/op_shading_frame.c), and the spreads. */
int nn_g_reads(const nn_arch *a);
int nn_detail_writes(const nn_arch *a);

/* Of pixel i of side, in -1 .. 1. */
static inline float nn_place(int i, int side) { return (2 * (float)i + 1) / (float)side - 1; }

/* Every pixel's place, across and down, in -1 .. 1: [n, side, side, NN_COORDINATES]. */
ag_value *nn_coordinates(ag_tape *tape, int n, int side);

/* g on its own input: photo [N, side, side, 3 images] log-encoded, side = nn_arch_side; conditions [tellings or
 * tellings N, g_size, g_size, NN_CONDITIONS images], telling by telling, or NULL where the architecture has none.
 * in: of which tellings and parts are read. */
bool nn_unet(ag_tape *tape, const nn_model *model, ag_value *photo, ag_value *conditions, const nn_input *in,
             nn_guess *guess);

/* What R_0 has at the photograph's size beyond the U-Net's coarse maps is made of squares of its pixels: [N, g_size,
 * g_size, g_detail] from features [N, g_size, g_size, g_width] of the U-Net and seen, what it read. to: NULL, or where
 * it goes, made by nn_squares_room before what may be forgotten then; that is NULL where there is no detail, or on a
 * tape with gradients. */
ag_value *nn_squares_room(ag_tape *tape, const nn_model *model, int images);
ag_value *nn_squares(ag_tape *tape, const nn_model *model, ag_value *seen, ag_value *features, ag_value *to);

/* Channels of a pixel at half of the photograph's side: the four pixels that it stands for. */
enum { NN_HALF_READS = 4 * 3 };

/* Rows of squares that are at the full size at once, on a tape without gradients, and as many more above and below as
 * two convolutions there reach, and three at half of the side. */
enum { NN_BAND = 32 };
static inline int nn_band_margin(const nn_arch *a)
{
    const int reach = 2 + (a->g_half > 0 ? 6 : 0);
    return (reach + a->g_unshuffle - 1) / a->g_unshuffle;
}

/* Maps and spread at photo's size, from nn_squares' y and the coarse maps [N, g_size, g_size, channels] before the
 * tanh.
 */
bool nn_full_size(ag_tape *tape, const nn_model *model, ag_value *photo, ag_value *y, ag_value *coarse,
                  nn_guess *guess);

/* The mean of g's guesses of photo [1, ...] in 2, 4 or 8 of its orientations, each turned back: of a photograph that
 * the light and the camera above its centre show alike in all of them. conditions [tellings, ...]; in: as above.
 * On a tape without gradients. */
bool nn_unet_oriented(ag_tape *tape, const nn_model *model, const ag_value *photo, ag_value *conditions,
                      const nn_input *in, int count, nn_guess *guess);

/* h: R_t [N, H, W, channels], its encoded gradients [N, H, W, images channels] (constants) and the states (updated;
 * NULL = zero) -> the change of the maps. to: NULL, or for each new state the value to write it into, which may be the
 * old one (a tape without gradients). */
ag_value *nn_change(ag_tape *tape, const nn_model *model, const nn_refiner *h, ag_value *maps, ag_value *gradient,
                    ag_value *gru[2], ag_value *const to[2]);

/* R_{t+1} from R_t and its encoded gradients. descent: what arch.descent adds beside h, or NULL. length: of the step, 1
 * for the whole. into: NULL, or the value to write it into, which may be R_t's. */
ag_value *nn_step(ag_tape *tape, const nn_model *model, const nn_refiner *h, ag_value *maps, ag_value *descent,
                  ag_value *gradient, ag_value *gru[2], ag_value *const to[2], float length, ag_value *into);

/* A model without parameters, a 3 x 3 convolution with bias that is added to it (gain: standard deviation of its output
 * for an input of standard deviation 1), and the plan with memory for its parameters, all zero; NULL and st on failure.
 */
nn_model *nn_model_empty(ts_status *st);
nn_model *nn_coder_plan(const nn_coder *c, ts_status *st);
nn_layer nn_plan_conv(nn_model *m, const char *name, int oc, int ic, double gain);
nn_model *nn_model_zero(nn_model *plan, ts_status *st);

/* Memory for the parameters of a plan (nn_model_plan), zero only between them: the caller writes all of them. sparse:
 * zero nowhere, for a caller that writes few. */
ts_code nn_model_allocate(nn_model *model, bool sparse, ts_status *st);
#endif
