#include "data/occlusion.h"
#include "tensor/scratch.h"
#include "tensor/team.h"
#include <math.h>
#include <stddef.h>

#define PI 3.14159265f
enum { SLICES = 8, STEPS_MOST = 64 };
#define GROWTH 1.2f /* of the steps along a direction: near ones hide more */

/* A pixel that may hide another: where it is beside it, right and down, and one over its distance. */
typedef struct step {
    int x, y;
    float over;
} step;

typedef struct slice {
    float x, y; /* its direction, right and down */
    int steps;
    step step[STEPS_MOST];
} slice;

typedef struct relief {
    int size;
    const float *height;
    bool repeats;
    slice slice[SLICES];
    float *to;
} relief;

static void plan(relief *r)
{
    const float reach = IO_OCCLUSION_REACH * (float)r->size;
    for (int k = 0; k < SLICES; k++) {
        slice *s = &r->slice[k];
        const float phi = PI * ((float)k + 0.5f) / SLICES;
        s->x = cosf(phi), s->y = sinf(phi), s->steps = 0;
        for (float t = 1; t <= reach && s->steps < STEPS_MOST; t = fmaxf(t + 1, t * GROWTH)) {
            const int x = (int)lroundf(t * s->x), y = (int)lroundf(t * s->y);
            s->step[s->steps++] = (step){x, y, (float)r->size / hypotf((float)x, (float)y)};
        }
    }
}

static int around(int i, int n) { return ((i % n) + n) % n; }

/* Row i, or NULL beyond the border. */
static const float *row_of(const relief *r, int i)
{
    if (r->repeats) i = around(i, r->size);
    return i < 0 || i >= r->size ? NULL : r->height + (size_t)i * (size_t)r->size;
}

/* dz/dx and dz/dy by the neighbours that there are. */
static void slopes(const relief *r, int i, float *dx, float *dy)
{
    const int n = r->size, last = n - 1;
    const float *here = row_of(r, i), *above = row_of(r, i - 1), *below = row_of(r, i + 1),
                scale = (float)n * (above && below ? 0.5f : 1);
    if (!above) above = here;
    if (!below) below = here;
    for (int j = 0; j < n; j++) dy[j] = scale * (below[j] - above[j]);
    for (int j = 1; j < last; j++) dx[j] = 0.5f * (float)n * (here[j + 1] - here[j - 1]);
    if (n == 1) dx[0] = 0;
    else if (r->repeats) {
        dx[0] = 0.5f * (float)n * (here[1] - here[last]);
        dx[last] = 0.5f * (float)n * (here[0] - here[last - 1]);
    } else dx[0] = (float)n * (here[1] - here[0]), dx[last] = (float)n * (here[last] - here[last - 1]);
}

/* The tangents of count pixels' horizons, where those of a row beside them are higher. */
static void raise_to(int count, const float *other, const float *z, float over, float *horizon)
{
    for (int j = 0; j < count; j++) {
        const float tangent = (other[j] - z[j]) * over;
        horizon[j] = tangent > horizon[j] ? tangent : horizon[j];
    }
}

/* Of row i, in a slice's direction (sign 1) or the other: the tangents of the highest elevations, or what is there. */
static void find_horizons(const relief *r, const slice *s, int sign, int i, float *horizon)
{
    const int n = r->size;
    const float *z = row_of(r, i);
    for (int k = 0; k < s->steps; k++) {
        const step *at = &s->step[k];
        const float *other = row_of(r, i + sign * at->y);
        if (!other) break; /* as all that are farther */
        const int x = sign * at->x,
                  right = r->repeats ? around(x, n)
            : x > 0                  ? x
                                     : 0,
                  left = right - x, inside = r->repeats ? n - right : n - right - left;
        if (inside <= 0) break;
        if (r->repeats) {
            raise_to(inside, other + right, z, at->over, horizon);
            raise_to(right, other, z + inside, at->over, horizon + inside);
        } else raise_to(inside, other + right, z + left, at->over, horizon + left);
    }
}

/* What a slice adds to each pixel: its part between the two horizons, whose tangents are up and down, of a surface that
 * falls by dx and dy. With g the normal's angle in the slice and h a horizon's from above (cos(h - g) is what counts),
 * (-cos(2h - g) + cos g + 2h sin g) / 4 each. */
static void add_slice(const slice *s, int n, const float *dx, const float *dy, const float *up, const float *down,
                      float *sum)
{
    for (int j = 0; j < n; j++) {
        const float along = -dx[j] * s->x - dy[j] * s->y, sides = 1 + along * along,
                    projected = sqrtf(sides / (dx[j] * dx[j] + dy[j] * dy[j] + 1)), cos_g = 1 / sqrtf(sides),
                    sin_g = along * cos_g, u = up[j], d = down[j], u2 = 1 + u * u, d2 = 1 + d * d,
                    cosines = (u * u - 1) / u2 + (d * d - 1) / d2, sines = 2 * u / u2 - 2 * d / d2,
                    angles = atanf(d) - atanf(u);
        sum[j] += projected * 0.25f * ((2 - cosines) * cos_g - sines * sin_g + 2 * angles * sin_g);
    }
}

static void occlude_rows(const void *job, int64_t begin, int64_t end)
{
    const relief *r = job;
    const int n = r->size;
    float *dx = ts_scratch(0, 5 * (size_t)n * sizeof *dx), *dy = dx + n, *up = dy + n, *down = up + n, *sum = down + n;
    for (int i = (int)begin; i < (int)end; i++) {
        slopes(r, i, dx, dy);
        for (int j = 0; j < n; j++) sum[j] = 0;
        for (int k = 0; k < SLICES; k++) {
            const slice *s = &r->slice[k];
            for (int j = 0; j < n; j++) { /* nothing below the tangent plane counts: itself is the least horizon */
                up[j] = dx[j] * s->x + dy[j] * s->y;
                down[j] = -up[j];
            }
            find_horizons(r, s, 1, i, up);
            find_horizons(r, s, -1, i, down);
            add_slice(s, n, dx, dy, up, down, sum);
        }
        for (int j = 0; j < n; j++) r->to[(size_t)i * (size_t)n + (size_t)j] = fminf(fmaxf(sum[j] / SLICES, 0), 1);
    }
}

void io_occlusion(int size, const float *height, bool repeats, float *occlusion, int threads)
{
    relief r = {.size = size, .height = height, .repeats = repeats, .to = occlusion};
    plan(&r);
    ts_for(threads, size, 1, occlude_rows, &r);
}
