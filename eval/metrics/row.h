/* What is measured of an estimate. */
#ifndef EV_ROW_H
#define EV_ROW_H
#include "eval/metrics/bands.h"

enum {
    EV_DIFFUSE,
    EV_SPECULAR,
    EV_ROUGHNESS,
    EV_NORMAL,
    EV_RENDER,
    EV_ANGLE,
    EV_SSIM,
    EV_FLIP,
    EV_EXPOSURE,
    EV_LPIPS,
    EV_FLAT,
    EV_OVER_FLAT,
    EV_BAND,
    EV_RESIDUE_DIFFUSE = EV_BAND + EV_BANDS,
    EV_RESIDUE_SPECULAR,
    EV_RESIDUE_ROUGHNESS,
    EV_RESIDUE_HUE,
    EV_RELIEF,
    EV_METRICS
};

typedef struct ev_row {
    double value[EV_METRICS]; /* RMSE; EV_ANGLE: degrees; EV_SSIM, EV_FLIP, EV_LPIPS: the mean over the renderings;
                               * EV_EXPOSURE: of captures, and of a fit; EV_FLAT: a flat map's EV_NORMAL, EV_OVER_FLAT
                               * the quotient of the two; EV_BAND ..: correlation of the normals (bands.h); the rest
                               * residue.h, of photographs alone. NaN: not measured */
} ev_row;
#endif
