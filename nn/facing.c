#include "nn/facing.h"
#include "tensor/maps.h"
#include "tensor/team.h"
#include <math.h>

typedef struct facing_job {
    rd_grid grid;
    const float *camera;
    int channels;
    float *maps;
} facing_job;

enum { WORTH = 16 }; /* rows that another thread is worth */

static void turn(const float v[3], float *normal)
{
    const float across = normal[0] * normal[0] + normal[1] * normal[1], flat = across > 1 ? 1 / sqrtf(across) : 1;
    const float n[3] = {flat * normal[0], flat * normal[1], sqrtf(fmaxf(1 - across, 0))};
    const float seen = n[0] * v[0] + n[1] * v[1] + n[2] * v[2], least = fminf(NN_FACING, v[2]);
    if (seen >= least) {
        normal[0] = n[0], normal[1] = n[1];
        return;
    }
    float beside[3], square = 0;
    for (int k = 0; k < 3; k++) beside[k] = n[k] - seen * v[k], square += beside[k] * beside[k];
    const float length = sqrtf((1 - least * least) / fmaxf(square, 1e-12f));
    for (int k = 0; k < 2; k++) normal[k] = least * v[k] + length * beside[k];
}

static void turn_rows(const void *job, int64_t begin, int64_t end)
{
    const facing_job *j = job;
    const float side = (float)j->grid.side;
    for (int64_t y = begin; y < end; y++)
        for (int x = 0; x < j->grid.w; x++) {
            const float to[3] = {j->camera[0] - ((float)(j->grid.x0 + x) + 0.5f) / side + 0.5f,
                                 j->camera[1] + ((float)(j->grid.y0 + (int)y) + 0.5f) / side - 0.5f, j->camera[2]};
            const float inverse = 1 / sqrtf(to[0] * to[0] + to[1] * to[1] + to[2] * to[2]);
            const float v[3] = {to[0] * inverse, to[1] * inverse, to[2] * inverse};
            turn(v, j->maps + (y * j->grid.w + x) * j->channels + MAP_NORMAL);
        }
}

void nn_face_camera(rd_grid grid, const float camera[3], int channels, float *maps)
{
    ts_for(grid.threads, grid.h, WORTH, turn_rows, &(facing_job){grid, camera, channels, maps});
}
