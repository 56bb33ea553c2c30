#include "data/occlusion.h"
#include "tensor/team.h"
#include <math.h>
#include <stddef.h>

#define PI 3.14159265f
enum { SLICES = 8 };
#define GROWTH 1.2f /* of the steps along a direction: near ones hide more */

typedef struct relief {
    int size;
    const float *height;
    bool repeats;
} relief;

/* The height of the pixel, or false beyond the border. */
static bool at(const relief *r, int i, int j, float *z)
{
    const int n = r->size;
    if (r->repeats) i = ((i % n) + n) % n, j = ((j % n) + n) % n;
    if (i < 0 || j < 0 || i >= n || j >= n) return false;
    *z = r->height[(size_t)i * (size_t)n + (size_t)j];
    return true;
}

/* dz/dx by the neighbours that there are; along the rows (x) or down the columns (y). */
static float slope(const relief *r, int i, int j, int di, int dj)
{
    float before = 0, after = 0, here = 0;
    at(r, i, j, &here);
    const bool left = at(r, i - di, j - dj, &before), right = at(r, i + di, j + dj, &after);
    const float difference = left && right ? 0.5f * (after - before) : right ? after - here : left ? here - before : 0;
    return difference * (float)r->size;
}

/* The tangent of the highest elevation that is met in the direction (dx right, dy down), or least. */
static float horizon(const relief *r, int i, int j, float z, float dx, float dy, float least)
{
    const float reach = IO_OCCLUSION_REACH * (float)r->size;
    for (float t = 1; t <= reach; t = fmaxf(t + 1, t * GROWTH)) {
        const int x = (int)lroundf(t * dx), y = (int)lroundf(t * dy);
        float other;
        if (!at(r, i + y, j + x, &other)) break;
        const float distance = hypotf((float)x, (float)y) / (float)r->size;
        if (distance > 0) least = fmaxf(least, (other - z) / distance);
    }
    return least;
}

/* Of a slice, the part between the normal's angle g (from above, toward the positive side) and its horizon at h. */
static float arc(float h, float g) { return 0.25f * (-cosf(2 * h - g) + cosf(g) + 2 * h * sinf(g)); }

static float visible(const relief *r, int i, int j)
{
    const float z = r->height[(size_t)i * (size_t)r->size + (size_t)j];
    const float nx = -slope(r, i, j, 0, 1), ny = -slope(r, i, j, 1, 0), length = sqrtf(nx * nx + ny * ny + 1);
    float sum = 0;
    for (int k = 0; k < SLICES; k++) {
        const float phi = PI * ((float)k + 0.5f) / SLICES, dx = cosf(phi), dy = sinf(phi);
        const float along = nx * dx + ny * dy, projected = sqrtf(along * along + 1) / length, g = atanf(along);
        /* nothing below the tangent plane counts: the plane itself is the least horizon */
        const float up = horizon(r, i, j, z, dx, dy, -along), down = horizon(r, i, j, z, -dx, -dy, along);
        const float ahead = 0.5f * PI - atanf(up), behind = -(0.5f * PI - atanf(down));
        sum += projected * (arc(ahead, g) + arc(behind, g));
    }
    return fminf(fmaxf(sum / SLICES, 0), 1);
}

typedef struct occlusion_job {
    const relief *r;
    float *to;
} occlusion_job;

static void occlude_rows(const void *job, int64_t begin, int64_t end)
{
    const occlusion_job *o = job;
    for (int64_t i = begin; i < end; i++)
        for (int j = 0; j < o->r->size; j++)
            o->to[(size_t)i * (size_t)o->r->size + (size_t)j] = visible(o->r, (int)i, j);
}

void io_occlusion(int size, const float *height, bool repeats, float *occlusion, int threads)
{
    const relief r = {size, height, repeats};
    ts_for(threads, size, 1, occlude_rows, &(occlusion_job){&r, occlusion});
}
