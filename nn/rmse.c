/* RMSE(R_t): how far renderings of maps are from the photographs. */
#include "nn/lgd_internal.h"
#include "render/render.h"
#include <math.h>

void nn_add_squares(const nn_model *model, const nn_input *in, const float *maps, int channels, double *squares)
{
    const int64_t pixels = (int64_t)in->grid.h * in->grid.w;
    for (int i = 0; i < in->image.shape.n; i++) {
        const rd_view view = nn_view_of(model, in, i);
        double rmse;
        rd_flash_rmse(in->grid, maps + i / nn_given(in) * pixels * channels, channels, &view,
                      in->image.data + i * pixels * 3, &rmse);
        squares[i] += rmse * rmse * (double)pixels;
    }
}

double nn_rmse_of(const double *squares, int photographs, double pixels)
{
    double sum = 0;
    for (int i = 0; i < photographs; i++) sum += squares[i] / photographs;
    return sqrt(sum / pixels);
}
