/* Shading of rows of pixels, and the losses on top of it. The equations are in render/brdf.h. Geometry (normals,
 * directions, the sine between normal and half vector) is done in double lanes, because a highlight of roughness 0.02
 * is 4e-4 wide and single precision knows directions to 1e-7; colours are in float. */
#ifndef TS_SHADE_H
#define TS_SHADE_H
#include "render/kernels/view.h"
#include "tensor/kernels/family.h"

struct ts_shade_kernels {
    /* image[count, 3] = min(radiance, limit). */
    void (*render)(const ts_shade_view *view, const ts_shade_row *row, float limit, float *image);
    /* image[count, 3] = radiance under the disk. view: TS_SHADE_POSITIONS without ambient light. */
    void (*render_disk)(const ts_shade_view *view, const ts_shade_row *row, const ts_shade_disk *disk, float *image);
    /* With e = min(radiance, 1) - image: returns the sum of e^2; gradient[count, channels] (may be NULL) = scale * sum
     * over rgb of e d min(radiance, 1) / d maps. */
    double (*flash)(const ts_shade_view *view, const ts_shade_row *row, const float *image, float scale,
                    float *gradient);
    /* The sum over views, pixels and rgb of |log(a + 0.01) - log(b + 0.01)| for the radiances a of row and b of target
     * (whose place and count are row's); gradient[count, channels] (may be NULL) = scale * its derivative by row's
     * maps. */
    double (*log_loss)(const ts_shade_view *views, int count, const ts_shade_row *row, const ts_shade_row *target,
                       float scale, float *gradient);
    /* out = a log(clamp(in, 0, 1) + 0.01) + b. in may be out. */
    void (*log_encode)(int count, const float *in, float a, float b, float *out);
};
TS_FAMILY(shade)
#endif
