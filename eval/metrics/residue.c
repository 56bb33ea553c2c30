#include "eval/metrics/residue.h"
#include "render/tone.h"
#include "tensor/maps.h"
#include <math.h>
#include <stdbool.h>
#include <stdint.h>

enum { DIFFUSE, SPECULAR = 3, ROUGHNESS = 6, VALUES };

static double unit(float x) { return (fmin(fmax((double)x, -1), 1) + 1) / 2; }

static double colour(const float *x) { return (double)rd_gamma((float)unit(*x)); }

static double mean3(const double *v) { return (v[0] + v[1] + v[2]) / 3; }

/* v over the mean of its colours; the floor is a black's. */
static double share(const double *v, int k) { return v[k] / (mean3(v) + 1e-3); }

ev_residue ev_residue_of(int size, const float *maps, int channels)
{
    double sum[2][VALUES] = {{0}}, squares = 0;
    int64_t count[2] = {0};
    for (int y = 0; y < size; y++)
        for (int x = 0; x < size; x++) {
            const float *m = maps + ((int64_t)y * size + x) * channels;
            const double r = hypot((x + 0.5) / size - 0.5, (y + 0.5) / size - 0.5);
            for (int k = 0; k < 2; k++) {
                const double n = fmin(fmax((double)m[MAP_NORMAL + k], -1), 1);
                squares += n * n;
            }
            const bool disk = r < EV_DISK;
            if (!disk && !(r >= EV_RING_INNER && r <= EV_RING_OUTER)) continue;
            double *to = sum[disk];
            count[disk]++;
            for (int k = 0; k < 3; k++) {
                to[DIFFUSE + k] += colour(&m[MAP_DIFFUSE + k]);
                to[SPECULAR + k] += colour(&m[MAP_SPECULAR + k]);
            }
            to[ROUGHNESS] += unit(m[MAP_ROUGHNESS]);
        }
    for (int k = 0; k < VALUES; k++) sum[0][k] /= (double)count[0], sum[1][k] /= (double)count[1];
    double hue = 0;
    for (int k = 0; k < 3; k++) {
        const double d = share(&sum[1][DIFFUSE], k) - share(&sum[0][DIFFUSE], k);
        hue += d * d / 3;
    }
    return (ev_residue){.diffuse = fabs(mean3(&sum[1][DIFFUSE]) - mean3(&sum[0][DIFFUSE])),
                        .specular = fabs(mean3(&sum[1][SPECULAR]) - mean3(&sum[0][SPECULAR])),
                        .roughness = fabs(sum[1][ROUGHNESS] - sum[0][ROUGHNESS]),
                        .hue = sqrt(hue),
                        .relief = sqrt(squares / (2.0 * size * size))};
}
