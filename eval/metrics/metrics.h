/* The measures of an estimate (docs/math.md, Evaluation). */
#ifndef EV_METRICS_H
#define EV_METRICS_H
#include "data/capture.h"
#include "data/material.h"
#include "eval/metrics/lpips.h"
#include "eval/metrics/row.h"
#include "nn/model.h"

extern const char *const ev_metric_name[EV_METRICS];

/* What one material is evaluated with: known maps, a capture, or only a photograph. */
typedef struct ev_case {
    int size;
    rd_view view;                 /* of the first input picture, as the methods know it */
    const float *image;           /* the input pictures, [inputs][size][size][3], linear, in [0, 1] */
    const float *taken;           /* NULL, or these as bright as they were taken: for methods that find the power */
    int inputs;                   /* 1 .. NN_MAX_IMAGES; all but the first are for methods that read several */
    rd_view input[NN_MAX_IMAGES]; /* their views, the first being view */
    double fov;                   /* the first input's true field of view in degrees (render/scene.h); 0: unknown */
    double exposure;              /* true power of the inputs' lights over the power that the methods know */
    const io_material *truth;     /* NULL: unknown */
    const io_material *peer;      /* another program's maps of it, or NULL */
    const rd_view *views;         /* RD_EVAL_VIEWS of them; not of a capture */
    const io_capture *capture;    /* not NULL when truth is and pictures are: compared by eval/multiview.h */
    bool perceptual;              /* also SSIM and FLIP, which take most of the time */
    bool fit;                     /* EV_RENDER after fitting one factor, EV_EXPOSURE, on the estimate's renderings */
    ev_lpips *lpips;              /* also LPIPS, unless NULL */
} ev_case;

/* One input, under the flash. */
ev_case ev_case_of_maps(const io_material *truth, const float *image, const rd_view *views, bool perceptual);
/* inputs: the first so many pictures of the capture, image being ev_capture_input's where light_known. */
ev_case ev_case_of_capture(const io_capture *capture, const float *image, int inputs, bool light_known,
                           bool perceptual);
/* One picture, taken for a flash photograph. */
ev_case ev_case_of_photo(const float *image, int size);

/* An input picture. */
typedef struct ev_photo {
    rd_view view;    /* as the methods know it */
    double exposure; /* factor on the light's power */
    float noise;     /* > 0: sensor noise of that strength and 8-bit quantisation, drawn with (seed, identity) */
    uint64_t seed, identity;
} ev_photo;

/* The rendering of it, clamped. image: size x size x 3. */
void ev_photograph(const io_material *truth, const ev_photo *photo, float *image);

/* The views of count inputs: the view given, then others of the predefined configurations of captures (render/scene.h),
 * drawn with (seed, identity). */
void ev_input_views(const rd_view *given, int count, uint64_t seed, uint64_t identity, rd_view *input);

/* The factor c of least sum of (gamma(c a) - gamma(b))^2 over the values that are not clipped: gamma(c a) =
 * c^(1/2.2) gamma(a). Both linear; 1 where all are clipped or black. */
double ev_factor(size_t values, const float *a, const float *b);

/* Whether SSIM, FLIP and LPIPS of pictures of that size are there where they are asked for: else memory was short. */
bool ev_perceived(int size, bool perceptual, bool lpips, const double value[EV_METRICS]);

/* The scores of one estimate. EV_RENDER is not finite where memory for any of them could not be had. */
ev_row ev_score(const ev_case *c, const float *maps, int channels);
#endif
