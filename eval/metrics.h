/* How good maps are (DESIGN section 5). */
#ifndef EV_METRICS_H
#define EV_METRICS_H
#include "data/capture.h"
#include "data/material.h"
#include "eval/lpips.h"
#include "render/scene.h"

enum { EV_DIFFUSE, EV_SPECULAR, EV_ROUGHNESS, EV_NORMAL, EV_RENDER, EV_ANGLE, EV_SSIM, EV_FLIP, EV_EXPOSURE, EV_LPIPS, EV_METRICS };
extern const char *const ev_metric_name[EV_METRICS];

typedef struct ev_row {
    double value[EV_METRICS]; /* RMSE; EV_ANGLE: degrees; EV_SSIM, EV_FLIP, EV_LPIPS: the mean over the renderings;
                                * EV_EXPOSURE: of captures. NaN: not measured */
} ev_row;

/* What one material is evaluated with: known maps, or a capture. */
typedef struct ev_case {
    int size;
    rd_view view;         /* of the input picture */
    const float *image;   /* the input picture, linear, in [0, 1] */
    const io_material *truth;
    const rd_view *views; /* RD_EVAL_VIEWS of them; not of a capture */
    const io_capture *capture; /* where it is not NULL, truth is: eval/multiview.h compares */
    bool perceptual;      /* SSIM and FLIP too, which take many times as long as the rest */
    ev_lpips *lpips;      /* LPIPS too, where it is not NULL */
} ev_case;

ev_case ev_case_of_maps(const io_material *truth, const float *image, const rd_view *views, bool perceptual);
ev_case ev_case_of_capture(const io_capture *capture, const float *image, bool perceptual);

/* The input picture: the flash rendering; noise > 0 adds sensor noise of that strength and 8-bit quantisation, drawn with
 * (seed, identity). image: size x size x 3. */
void ev_photograph(const io_material *truth, float noise, uint64_t seed, uint64_t identity, float *image);

/* What one estimate scores. */
ev_row ev_score(const ev_case *c, const float *maps, int channels);
#endif
