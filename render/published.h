/* Light and colour of the published code (Luo et al. 2024) where it differs from this project: what a model with
 * `compat = published` runs with. Its flash renderer is that of render/brdf.h with other guards against 0/0:
 * roughness >= 1e-6 and, with e = 1e-6 for each,
 *
 *     D = alpha^2 / (pi (...)^2 + e)
 *     G = g(n.l) g(n.v),  g(c) = c / (c (1 - k) + k),  k = alpha / 2 + e
 *     f = ... + D G F / (4 n.l n.v + e) */
#ifndef RD_PUBLISHED_H
#define RD_PUBLISHED_H
#include "render/kernels/view.h"
#include "render/scene.h"

typedef struct rd_published_constants {
    double distance; /* of camera and light from the sample, in patch widths */
    double power;    /* of the light, in the same unit squared */
    double gamma;    /* photographs are raised to it */
    double gradient; /* factor on dRMSE / dmaps for the refiner */
    double rmse;     /* lower bound of the RMSE in the gradient: against 0/0; the published code has none */
    ts_shade_guards guards;
} rd_published_constants;
extern const rd_published_constants rd_published;

/* The published flash photograph. */
rd_view rd_published_flash(void);
#endif
